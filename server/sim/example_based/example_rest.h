#pragma once

#include "server/sim/example_based/example_set.h"
#include "server/sim/example_based/geodesic_distance.h"
#include "server/sim/example_based/qlerp.h"
#include "server/sim/example_based/surface_tree.h"
#include "server/sim/mesh/embedding.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace crumple::sim::example_based {

// Example weights, a vertex a row: what a step touches is rows.
using WeightMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// T_be of Jones et al. 2016, section 3, ready to be blended.
struct BonePose {
  Vec4 q;  // s_be q_be: normalised, aligned with the rest pose (x, y, z, w)
  Vec4 t;  // translation [m], last entry 0: four wide, as q is
};

// M_ij of the consistent mass matrix over the body's mass: a twentieth of the shares of all tets that i and j have in common.
struct EdgeShare {
  int vertex;    // j
  double share;  // [-]
};

struct BoneWeight {
  int bone;
  double weight;  // > 0
};

// Everything about an example-based body that no step changes. Made once when the scene loads.
struct ExampleRest {
  std::shared_ptr<const ExampleSet> set;

  // Skinning.
  std::vector<BonePose> poses;      // B x E, bone-major: T_be is poses[b * E + e]
  std::vector<std::int8_t> sign;    // s_be, as poses
  std::vector<std::uint8_t> turns;  // B: 0 where all poses of the bone have the rest pose's rotation
  std::vector<int> weight_start;    // N + 1: weights of vertex i at [start[i], start[i + 1])
  std::vector<BoneWeight> weights;  // the entries of W above 0; each row sums to 1 to rounding
  std::vector<Vec3> x_rest;         // N: skinned in the rest pose [m]; equal to u where that is the identity
  double size = 0;                  // diagonal of their box [m]

  // Where no bone turns in any example, eq. 3 is linear in E: x_i = u'_i + sum_e E_ie D_ie, and J_i = D_i is constant.
  bool linear = false;
  std::vector<Vec3> turned_u;  // N: u'_i = sum_b W_ib R(q_b) u_i [m], with the rotations that all examples share
  std::vector<Vec4> basis;     // N x E, vertex-major: D_ie = sum_b W_ib t_be [m], last entry 0; empty unless linear
  int first_example = 0;       // D_ie = 0 for e below it: 1 where the rest pose moves nothing

  // Mass. Shares sum to 1; they follow the rest volume times fill and stay while the body deforms.
  double volume = 0;                 // of mesh.X, times fill [m^3]
  double shape_volume = 0;           // of x_rest, times fill [m^3]
  std::vector<double> tet_share;     // [-]
  std::vector<double> vertex_share;  // [-], a quarter of each tet's share to each of its vertices

  std::vector<int> upper_start;        // N + 1: edges i-j with i < j at [start[i], start[i + 1])
  std::vector<EdgeShare> upper_edges;  // ascending by j

  // Propagation.
  EdgeGraph graph;

  double least_beta_scale = 1;  // of the surface's vertices [-]: where the body yields first

  // Surface.
  std::vector<Triangle> surface;      // vertex ids, counter-clockwise from outside
  std::vector<int> surface_vertices;  // ascending
  SurfaceTree surface_tree;

  // Collision: for each convex part, the vertices that can lie on its hull (hull_points.h).
  std::vector<std::vector<int>> hull_vertices;

  // Drawing: `render` carried by the tets, or the surface itself (draw_shape.h).
  Embedding embedding;                   // empty where the surface is drawn
  std::vector<Triangle> draw_triangles;  // ids of draw vertices

  int vertex_count() const { return set->vertex_count(); }
  int bone_count() const { return set->bone_count(); }
  int example_count() const { return set->example_count(); }
  const BonePose& pose(int bone, int example) const { return poses[bone * example_count() + example]; }
};

inline double fill_of(const TetMesh& mesh, std::size_t t) { return mesh.fill.empty() ? 1 : mesh.fill[t]; }

// Sum over the tets of their volumes in shape x times fill [m^3]; an inverted tet's is below 0. x: N [m].
double shape_volume(const TetMesh& mesh, std::span<const Vec3> x);

// Volume of the set's tets at rest, times fill [m^3]: what a density is of.
double rest_volume(const ExampleSet& set);

// `set` must have passed `validate`.
ExampleRest make_rest(std::shared_ptr<const ExampleSet> set);

}  // namespace crumple::sim::example_based
