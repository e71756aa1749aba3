#pragma once

#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/rig_weights.h"

namespace crumple::authoring {

// What every generated asset shares: tets drawn onto the surface (boundary_fit.h), bones on them (handle_placement.h),
// weights (rig_weights.h), and the surface itself as the graphical mesh. Examples and convex parts are for the
// caller to add. Barrels and cars keep Gaussian weights: they have no gaps that a bone could act across, and their
// poses and the scenes that use them are tuned with those.
struct Rig {
  sim::example_based::ExampleSet set;  // mesh, W, render; examples = {rest}
  std::vector<Vec3> bones;             // rest positions [m]
  std::vector<int> surface;            // ids of nodes to collide by (nodes_at_solid, a tenth of a cell), ascending
  EnclosingReport report;
};

// Bones: so many, placed by place_handles, or what `place` makes of the mesh and its surface nodes [m].
// Errors: what enclosing_mesh and the weights reject; bones below 1 or above kMaxBones.
Result<Rig> make_rig(const sim::SurfaceMesh& surface, const EnclosingOptions& enclosing, int bones,
                     RigWeights weights = RigWeights::gaussian);
using BonePlacement = std::function<std::vector<Vec3>(const sim::TetMesh& mesh, const std::vector<int>& surface)>;
Result<Rig> make_rig(const sim::SurfaceMesh& surface, const EnclosingOptions& enclosing, const BonePlacement& place,
                     RigWeights weights = RigWeights::gaussian);

// Adds an example that imitates a field.
void add_example(Rig& rig, const std::string& name, const PoseField& field,
                 BoneRotations rotations = BoneRotations::none);

// One side of a box after the other pushed in by `depth` of the extent along the push, (0, 0.6]: "crushed_min_x" ...
std::vector<std::pair<std::string, PoseField>> crushed_sides(const Eigen::AlignedBox3d& box, double depth);

// Slabs that make about cubes of a box: its longest extent over its second longest, 1 to 6.
int default_slabs(const Vec3& extent);

struct DefaultAssetOptions {
  EnclosingOptions enclosing;  // cell size or tet budget
  int bones = 24;
  double depth = 0.25;   // of the extent along the push, how far a side goes in, (0, 0.6]
  int convex_parts = 0;  // slabs along the longest axis; 0: its ratio to the second longest, at most 6
  RigWeights weights = RigWeights::gaussian;
};

// A rig for any surface without one: rest, and one crushed pose for each side of its box ("crushed_min_x" ...), so that
// it dents from wherever it is hit. Errors: make_rig's; depth out of range; a surface too thin for a convex part.
Result<sim::example_based::ExampleSet> make_default_asset(const sim::SurfaceMesh& surface,
                                                          const DefaultAssetOptions& options = {});

}  // namespace crumple::authoring
