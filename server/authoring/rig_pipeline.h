#pragma once

#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/rig_methods.h"

#include <functional>

// From what an artist made to an asset: algorithm 1 of Jones et al. 2016, section 4, in one call.
namespace crumple::authoring {

// An example given by some of its handles; the others follow (RigMethods::complete).
struct HandleMove {
  std::string handle;
  std::optional<Vec3> position;      // where the handle's point goes [m]; none: it stays
  Quat rotation = Quat::Identity();  // how it turns
};
struct NamedPose {
  std::string name;
  std::vector<HandleMove> moves;
};

struct RigOptions {
  EnclosingOptions enclosing;  // cell size or tet budget
  bool keep_lattice = false;   // tets of the lattice; else drawn onto the surface and pushed out until they enclose its
                               // vertices (boundary_fit.h), so that the body touches where it is drawn; where that does
                               // not enclose all, those of the lattice, and a warning
  std::vector<sim::example_based::Handle> handles;  // beside those of the mesh
  int automatic_handles = -1;                       // added; -1: kDefaultHandles where no handle is given, else none
  bool painted_weights = false;  // the mesh's own joint weights, carried to the tets, instead of computed ones
  bool painted_regions = false;  // the mesh's colours scale alpha and beta (painted_regions.h)
  std::vector<NamedPose> poses;  // beside the mesh's own poses and copies
  enum class Crushed {
    where_no_other,
    always,
    never
  } crushed = Crushed::where_no_other;  // a pose for each side of the box
  double crush_depth = 0.25;            // of the extent along the push, (0, 0.6]
  int convex_parts = 0;                 // slabs along the longest axis; 0: its ratio to the second longest, at most 6
};

inline constexpr int kDefaultHandles = 24;

struct ExampleReport {
  std::string name;
  enum class Source { animation, copy, handles, crushed } source = Source::crushed;
  double residual_rms = 0,
         residual_largest = 0;  // of a copy: from where it has the surface's vertices to where its pose puts them [m]
};

struct RigReport {
  int vertices = 0, triangles = 0;  // of the surface
  int vertices_enclosed = 0;        // by the tets: all
  EnclosingReport enclosing;
  int nodes = 0, tets = 0;
  int given_handles = 0, automatic_handles = 0;
  std::vector<ExampleReport> examples;  // without the rest pose
  std::vector<std::string> warnings;
};

struct RiggedAsset {
  sim::example_based::ExampleSet set;  // passes validate
  RigReport report;
};

// Called at each stage with the part of the work that is done, in [0, 1], and what comes next.
using RigProgress = std::function<void(double done, const std::string& stage)>;

// Errors name option, value and rule: enclosing_mesh's; handles above 1024, none at all, two of one name, or (a
// warning) far outside of the surface; a pose that names no handle; painted weights or colours where there are none, or
// painted weights with automatic handles; more than 64 examples; a copy of another number of vertices; crush_depth or
// convex_parts out of range; a surface too thin for a convex part.
Result<RiggedAsset> make_asset(const ArtistMesh& mesh, const RigOptions& options, const RigProgress& progress = {},
                               const RigMethods& methods = default_rig_methods());

// Adds the pose as an example to a set that has handles; those that it does not name stay where they are at rest
// (add_held_pose) or follow (add_pose). Errors: no handles, one that is not there, a name taken, the 65th example.
Result<void> add_pose(sim::example_based::ExampleSet& set, const NamedPose& pose,
                      const RigMethods& methods = default_rig_methods());
Result<void> add_held_pose(sim::example_based::ExampleSet& set, const NamedPose& pose);

// Fits the pose of a deformed copy of the set's render surface, and adds it. Errors: as add_pose; no render surface.
Result<ExampleReport> add_copy(sim::example_based::ExampleSet& set, const DeformedCopy& copy,
                               const RigMethods& methods = default_rig_methods());

}  // namespace crumple::authoring
