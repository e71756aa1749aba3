#pragma once

#include "server/authoring/handles.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/mesh/tet_tree.h"

namespace crumple::authoring {

// Handles as an artist gives them [Jones et al. 2016, section 4: "bones, points, and cages"]. Lengths in metres.
struct NamedBone {
  std::string name;
  Vec3 from = Vec3::Zero();  // its handle turns about this end
  Vec3 to = Vec3::UnitX();
};
struct NamedCage {
  std::string name;  // its points are handles: "NAME 1" and on
  std::vector<Vec3> points;
  std::vector<std::array<int, 2>> edges = {};  // ids of points
  std::vector<Triangle> faces = {};            // ids of points
};
struct GivenHandles {
  std::vector<sim::example_based::Handle> points;
  std::vector<NamedBone> bones;
  std::vector<NamedCage> cages;

  bool empty() const { return points.empty() && bones.empty() && cages.empty(); }
};

// Errors, by the path that a HandleList of rig.proto has (`bones[2].to`): no handle at all; a name that is empty, above
// 256 bytes or taken; positions that are not finite or beyond 1e6 m; a bone without length; a cage with neither edges
// nor faces, with a point in none of them, or with ids that are not there or named twice.
Result<void> validate(const GivenHandles& given);

// All handles of a rig in one order: what they are called and turn about, as the asset keeps them, and what is theirs,
// as weights are made of.
struct RigHandles {
  std::vector<sim::example_based::Handle> named;
  Handles shapes;

  int count() const { return shapes.count(); }
  bool are_points() const;  // no bone, no cage
  void add_point(const sim::example_based::Handle& point);
  void add_bone(const NamedBone& bone);
  void add_cage(const NamedCage& cage);
  void add(const GivenHandles& given);
};

// Where automatic handles should not be: points, and five places along each bone [m].
std::vector<Vec3> places_of(const Handles& handles);

// How far a handle is outside of the tets: of a bone the place that is nearest to them, `spacing` apart [m].
double distance_outside(const sim::TetTree& tree, const Handle& handle, double spacing);

}  // namespace crumple::authoring
