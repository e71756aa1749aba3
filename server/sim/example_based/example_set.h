#pragma once

#include "common/error.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <string>
#include <vector>

namespace crumple::sim::example_based {

// Where one bone (handle) goes in one example: x = R(q) u + t about the object's origin (CITED: one convention).
struct BoneTransform {
  Quat q = Quat::Identity();
  Vec3 t = Vec3::Zero();  // [m]
};

// An example pose: T_be of Jones et al. 2016, section 3.
struct Example {
  std::string name;
  std::vector<BoneTransform> bones;  // B
};

// What an artist takes hold of: a bone by its name, and the point of it that rests there.
struct Handle {
  std::string name;
  Vec3 position = Vec3::Zero();  // at rest, in the asset's axes [m]
};

// The authored, constant part of an example-based body: u, W and T of Jones et al. 2016, section 3.
struct ExampleSet {
  TetMesh mesh;                   // u: undeformed vertices [m] in the asset's axes, N of them, and their tets
  Eigen::MatrixXd W;              // N x B skinning weights, 0 <= W, rows sum to 1
  std::vector<Example> examples;  // E; examples[0] is the rest pose

  // Collision: vertex ids of each convex part (hulls that move with the skin); one part at least.
  std::vector<std::vector<int>> convex_parts;

  // Graphical mesh in the asset's axes; carried by the tets. Empty: the tets' own surface is drawn.
  SurfaceMesh render;

  // Weak and strong regions, one factor a vertex: alpha (eq. 8) and beta (eq. 4) of an impulse at vertex i are those of
  // the body times these. Empty: 1 everywhere.
  std::vector<double> alpha_scale;  // [-], [0, 1e6]
  std::vector<double> beta_scale;   // [-], [0, 1e6]

  // The bones as their artist knows them, for authoring only: B in the order of W's columns, or none.
  std::vector<Handle> handles;

  double alpha_scale_at(int i) const { return alpha_scale.empty() ? 1 : alpha_scale[i]; }
  double beta_scale_at(int i) const { return beta_scale.empty() ? 1 : beta_scale[i]; }
  int vertex_count() const { return mesh.node_count(); }
  int bone_count() const { return static_cast<int>(W.cols()); }
  int example_count() const { return static_cast<int>(examples.size()); }
};

// The six parameters of Jones et al. 2016, section 4, the default restitution, and what goes beyond the paper.
struct ExampleParameters {
  double alpha = 100;        // scale from displacement to example weight [1/m], eq. 8; [0, 1e9]
  double beta = 0;           // plastic yield threshold [N s], eq. 4; [0, 1e12]
  double gamma = 0.5;        // kernel radius [m], eq. 11; (0, 1e6]
  double lambda = 0.95;      // plasticity rate in [0, 1), eq. 13; per dt_ref unless raw_rates
  double mu = 0.5;           // recovery of restitution [1/s], eq. 15; [0, 1e6]
  double nu = 2;             // loss of restitution by deformation [-], eq. 15; [0, 1e6]
  double restitution = 0.1;  // C_r^*, [0, 1]
  bool raw_rates = false;    // the paper's: eq. 4 and 13 per step whatever dt is (DESIGN decision 7)
  enum class Step { equation8, equation9, equation10 } step = Step::equation8;
  bool triangle_collision = false;  // GImpact triangle mesh instead of skinned convex parts (decision 6)
  bool tet_collision = false;       // every tet a convex part, as in the paper's section 5; not both
  // Which of the weights that give one shape: secondary_goal.h.
  enum class SecondaryGoal { none, few_examples, smooth_weights } secondary_goal = SecondaryGoal::none;
  double goal_tolerance = 1e-4;  // what it may move a vertex by after a dent, over the body's size [-], [0, 0.1]
  bool keep_volume = false;      // kept_volume.h
  double fatigue_time = 0;       // impulses below beta fade by 1/e in this time [s], [0, 1e6]; 0: at once; fatigue.h
};

// Size limits of what the server accepts.
inline constexpr double kMaxRegionScale = 1e6;  // of alpha and beta
inline constexpr int kMaxExamples = 64;  // the paper's bodies have 3 to 6
inline constexpr int kMaxBones = 1024;   // the paper's have 12 to 64

// Rejects what `validate(TetMesh)` rejects, W of another size, outside [0, 1] by more than 1e-9 or with rows that do
// not sum to 1 within 1e-6, no example, another number of bones, non-finite transforms, quaternions shorter than 1e-6,
// convex parts that are empty, under four vertices or out of range, handles of another number than bones or not finite,
// scales of alpha or beta of another number than the vertices or outside [0, 1e6], and a non-empty `render` that
// `validate(SurfaceMesh)` rejects. `field` prefixes the error's path.
Result<void> validate(const ExampleSet& set, const std::string& field);

}  // namespace crumple::sim::example_based
