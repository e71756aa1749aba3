#include "server/sim/example_based/example_rest.h"

#include "server/sim/example_based/draw_shape.h"
#include "server/sim/example_based/hull_points.h"
#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::example_based {
namespace {

void align_poses(ExampleRest& rest) {
  const ExampleSet& set = *rest.set;
  std::vector<Quat> q(set.example_count());
  for (int b = 0; b < set.bone_count(); ++b) {
    for (int e = 0; e < set.example_count(); ++e) q[e] = set.examples[e].bones[b].q.normalized();
    const std::vector<std::int8_t> signs = alignment_signs(q);
    bool turns = false;
    for (int e = 0; e < set.example_count(); ++e) {
      const Vec3& t = set.examples[e].bones[b].t;
      rest.sign.push_back(signs[e]);
      rest.poses.push_back({signs[e] * q[e].coeffs(), Vec4(t.x(), t.y(), t.z(), 0)});
      turns |= rest.poses.back().q != rest.pose(b, 0).q;
    }
    rest.turns.push_back(turns);
  }
}

// Rows that sum to 1 only to what a file's digits give are scaled, so that the identity keeps every vertex to rounding.
void gather_weights(ExampleRest& rest) {
  const Eigen::MatrixXd& W = rest.set->W;
  rest.weight_start.push_back(0);
  for (int i = 0; i < W.rows(); ++i) {
    const double sum = W.row(i).cwiseMax(0).sum();
    for (int b = 0; b < W.cols(); ++b)
      if (W(i, b) > 0) rest.weights.push_back({b, W(i, b) / sum});
    rest.weight_start.push_back(static_cast<int>(rest.weights.size()));
  }
}

void gather_basis(ExampleRest& rest) {
  rest.linear = std::ranges::none_of(rest.turns, [](std::uint8_t turns) { return turns != 0; });
  if (!rest.linear) return;
  const int examples = rest.example_count();
  rest.turned_u.assign(rest.vertex_count(), Vec3::Zero());
  rest.basis.assign(static_cast<std::size_t>(rest.vertex_count()) * examples, Vec4::Zero());
  bool still = true;
  for (int i = 0; i < rest.vertex_count(); ++i) {
    bool turns = false;
    for (int k = rest.weight_start[i]; k < rest.weight_start[i + 1]; ++k) {
      const auto& [bone, weight] = rest.weights[k];
      const Vec4& q = rest.pose(bone, 0).q;
      turns |= !q.head<3>().isZero(0);
      rest.turned_u[i] += weight * rotate(q, rest.set->mesh.X[i]);
      for (int e = 0; e < examples; ++e) rest.basis[i * examples + e] += weight * rest.pose(bone, e).t;
    }
    if (!turns) rest.turned_u[i] = rest.set->mesh.X[i];  // to the bit: weights sum to 1 only to rounding
    still &= rest.basis[i * examples].isZero(0);
  }
  rest.first_example = still ? 1 : 0;
}

void skin_rest_pose(ExampleRest& rest) {
  bool identity = true;
  for (int b = 0; b < rest.bone_count(); ++b) {
    const BonePose& T = rest.pose(b, 0);
    identity &= T.t.isZero(0) && T.q.head<3>().isZero(0);
  }
  rest.x_rest = rest.set->mesh.X;
  if (!identity)
    for (int i = 0; i < rest.vertex_count(); ++i) rest.x_rest[i] = skin_in_example(rest, i, 0);
  Eigen::AlignedBox3d box;
  for (const Vec3& x : rest.x_rest) box.extend(x);
  rest.size = box.diagonal().norm();
  rest.shape_volume = shape_volume(rest.set->mesh, rest.x_rest);
}

double filled_volume(const TetMesh& mesh, int t) {
  return signed_volume(mesh, t) * fill_of(mesh, t);
}

void share_mass(ExampleRest& rest) {
  const TetMesh& mesh = rest.set->mesh;
  rest.tet_share.resize(mesh.tet_count());
  rest.vertex_share.assign(mesh.node_count(), 0);
  rest.volume = rest_volume(*rest.set);
  for (int t = 0; t < mesh.tet_count(); ++t) {
    rest.tet_share[t] = filled_volume(mesh, t) / rest.volume;
    for (int i : mesh.tets[t]) rest.vertex_share[i] += rest.tet_share[t] / 4;
  }
}

void share_mass_of_edges(ExampleRest& rest) {
  const EdgeGraph& graph = rest.graph;
  rest.upper_start.push_back(0);
  for (int i = 0; i < graph.vertex_count(); ++i) {
    for (int k = graph.start[i]; k < graph.start[i + 1]; ++k)
      if (graph.neighbour[k] > i) rest.upper_edges.push_back({graph.neighbour[k], 0});
    rest.upper_start.push_back(static_cast<int>(rest.upper_edges.size()));
  }
  const std::vector<Tet>& tets = rest.set->mesh.tets;
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int i : tets[t])
      for (int j : tets[t]) {
        if (i >= j) continue;
        const auto begin = rest.upper_edges.begin() + rest.upper_start[i], end = rest.upper_edges.begin() + rest.upper_start[i + 1];
        std::lower_bound(begin, end, j, [](const EdgeShare& e, int v) { return e.vertex < v; })->share += rest.tet_share[t] / 20;
      }
}

void find_surface(ExampleRest& rest) {
  for (const SurfaceFace& face : surface_faces(rest.set->mesh.tets)) rest.surface.push_back(face.nodes);
  for (const Triangle& triangle : rest.surface)
    rest.surface_vertices.insert(rest.surface_vertices.end(), triangle.begin(), triangle.end());
  std::sort(rest.surface_vertices.begin(), rest.surface_vertices.end());
  rest.surface_vertices.erase(std::unique(rest.surface_vertices.begin(), rest.surface_vertices.end()),
                              rest.surface_vertices.end());
  rest.surface_tree = SurfaceTree(rest.x_rest, rest.surface);
}

}  // namespace

double shape_volume(const TetMesh& mesh, std::span<const Vec3> x) {
  double volume = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& [a, b, c, d] = mesh.tets[t];
    volume += fill_of(mesh, t) / 6 * (x[b] - x[a]).cross(x[c] - x[a]).dot(x[d] - x[a]);
  }
  return volume;
}

double rest_volume(const ExampleSet& set) {
  double volume = 0;
  for (int t = 0; t < set.mesh.tet_count(); ++t) volume += filled_volume(set.mesh, t);
  return volume;
}

ExampleRest make_rest(std::shared_ptr<const ExampleSet> set) {
  assert(set && validate(*set, "set"));
  ExampleRest rest;
  rest.set = std::move(set);
  align_poses(rest);
  gather_weights(rest);
  gather_basis(rest);
  skin_rest_pose(rest);
  share_mass(rest);
  rest.graph = edge_graph(rest.set->mesh.X, rest.set->mesh.tets);
  share_mass_of_edges(rest);
  find_surface(rest);
  rest.least_beta_scale = kMaxRegionScale;
  for (int i : rest.surface_vertices) rest.least_beta_scale = std::min(rest.least_beta_scale, rest.set->beta_scale_at(i));
  for (const std::vector<int>& part : rest.set->convex_parts) rest.hull_vertices.push_back(hull_candidates(rest, part));
  prepare_drawing(rest);
  return rest;
}

}  // namespace crumple::sim::example_based
