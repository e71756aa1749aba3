#include "server/authoring/handles.h"

#include "common/text.h"
#include "server/authoring/surface_distance.h"
#include "server/authoring/surface_transfer.h"
#include "server/authoring/tet_laplacian.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/mesh/tet_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

namespace crumple::authoring {
namespace {

using sim::linear_solver::RowMatrix;

enum Rank { kPoint, kCage, kBone };  // who goes before whom

struct Claim {
  Rank rank;
  Eigen::RowVectorXd weights;  // sum of what the claimants ask for
};

// Barycentric coordinates, in [0, 1], of the point of a segment or a triangle that is nearest to p.
Eigen::VectorXd coordinates_in(std::span<const Vec3> corners, const Vec3& p) {
  if (corners.size() == 3) {
    const std::array<Vec3, 3> triangle{corners[0], corners[1], corners[2]};
    const Vec3 w = barycentric(nearest_point_on_triangle(p, triangle), triangle).cwiseMax(0);
    return w / w.sum();
  }
  const Vec3 edge = corners[1] - corners[0];
  const double length2 = edge.squaredNorm(), s = length2 > 0 ? edge.dot(p - corners[0]) / length2 : 0;
  return Eigen::Vector2d(1 - std::clamp(s, 0.0, 1.0), std::clamp(s, 0.0, 1.0));
}

class Claims {
 public:
  Claims(const sim::TetMesh& mesh, int columns, double reach)
      : mesh_(mesh),
        tree_(mesh),
        columns_(columns),
        mean_edge_(mean_edge_length(mesh)),
        reach_(reach > 0 ? reach : mean_edge_) {}

  double reach() const { return reach_; }
  double distance(const Vec3& p) const { return std::sqrt(tree_.nearest(p).squared_distance); }

  // The vertex that a place belongs to; -1: outside.
  int vertex_at(const Vec3& p) const {
    const auto hit = tree_.nearest(p);
    if (!(hit.squared_distance <= reach_ * reach_)) return -1;
    const Tet& tet = mesh_.tets[hit.tet];
    return *std::ranges::min_element(tet, {}, [&](int i) { return (mesh_.X[i] - p).squaredNorm(); });
  }

  // The vertices of a segment or a triangle, ascending; samples four to an edge of the mesh.
  std::vector<int> vertices_along(std::span<const Vec3> corners) const {
    double longest = 0;
    for (const Vec3& c : corners) longest = std::max(longest, (c - corners[0]).norm());
    const int most = corners.size() == 2 ? 10000 : 200;
    const int n = static_cast<int>(std::clamp(std::ceil(4 * longest / mean_edge_), 1.0, static_cast<double>(most)));
    std::vector<int> out;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= (corners.size() == 2 ? 0 : n - i); ++j) {
        Vec3 p = corners[0] + (corners[1] - corners[0]) * (static_cast<double>(i) / n);
        if (corners.size() == 3) p += (corners[2] - corners[0]) * (static_cast<double>(j) / n);
        if (const int v = vertex_at(p); v >= 0) out.push_back(v);
      }
    std::ranges::sort(out);
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }

  void add(int vertex, Rank rank, std::span<const int> handles, const Eigen::VectorXd& weights) {
    auto [it, fresh] = claims_.try_emplace(vertex, Claim{rank, Eigen::RowVectorXd::Zero(columns_)});
    if (it->second.rank < rank) return;
    if (it->second.rank > rank) it->second = {rank, Eigen::RowVectorXd::Zero(columns_)};
    for (size_t k = 0; k < handles.size(); ++k) it->second.weights[handles[k]] += weights[static_cast<int>(k)];
  }

  PrescribedWeights rows() const {
    PrescribedWeights out;
    out.weights.resize(static_cast<int>(claims_.size()), columns_);
    for (const auto& [vertex, claim] : claims_) {
      out.weights.row(static_cast<int>(out.vertices.size())) = claim.weights / claim.weights.sum();
      out.shared += claim.rank != kCage && claim.weights.sum() > 1.5;
      out.vertices.push_back(vertex);
    }
    return out;
  }

 private:
  const sim::TetMesh& mesh_;
  sim::TetTree tree_;
  int columns_;
  double mean_edge_, reach_;
  std::map<int, Claim> claims_;
};

Result<void> check(const Handles& handles, const std::string& field) {
  using sim::example_based::kMaxBones;
  const int B = handles.count();
  if (B < 1 || B > kMaxBones) return invalid(field, text("holds ", B, " handles, must hold 1 to ", kMaxBones));
  for (int b = 0; b < B; ++b)
    if (!handles.handles[b].from.allFinite() || !handles.handles[b].to.allFinite())
      return invalid(text(field, "[", b, "]"), "is not finite");
  const auto check_ids = [&](std::span<const int> ids, const std::string& path) -> Result<void> {
    for (size_t k = 0; k < ids.size(); ++k) {
      if (ids[k] < 0 || ids[k] >= B) return invalid(path, text("names handle ", ids[k], ", must be in [0, ", B, ")"));
      if (!handles.handles[ids[k]].is_point())
        return invalid(path, text("names handle ", ids[k], ", which is a bone, must be a point"));
      if (std::ranges::count(ids, ids[k]) > 1) return invalid(path, text("names handle ", ids[k], " twice"));
    }
    return {};
  };
  for (size_t e = 0; e < handles.cage_edges.size(); ++e)
    if (auto ok = check_ids(handles.cage_edges[e], text(field, ".cage_edges[", e, "]")); !ok) return ok;
  for (size_t f = 0; f < handles.cage_faces.size(); ++f)
    if (auto ok = check_ids(handles.cage_faces[f], text(field, ".cage_faces[", f, "]")); !ok) return ok;
  return {};
}

// Vertices along a cage's edge or face get the barycentric coordinates there, between the corners' own vertices.
void claim_cage_part(Claims& claims, const sim::TetMesh& mesh, const Handles& handles, std::span<const int> ids) {
  std::vector<Vec3> corners, snapped;
  for (const int id : ids) {
    corners.push_back(handles.handles[id].from);
    snapped.push_back(mesh.X[claims.vertex_at(corners.back())]);
  }
  for (const int v : claims.vertices_along(corners)) claims.add(v, kCage, ids, coordinates_in(snapped, mesh.X[v]));
}

}  // namespace

Result<PrescribedWeights> prescribed_weights(const sim::TetMesh& mesh, const Handles& handles, double reach,
                                             const std::string& field) {
  if (auto ok = check(handles, field); !ok) return std::unexpected(ok.error());
  Claims claims(mesh, handles.count(), reach);
  const Eigen::VectorXd whole = Eigen::VectorXd::Ones(1);
  for (int b = 0; b < handles.count(); ++b) {
    const Handle& handle = handles.handles[b];
    std::vector<int> vertices = claims.vertices_along(std::array{handle.from, handle.to});
    if (vertices.empty())
      return invalid(text(field, "[", b, "]"),
                     text("is ", claims.distance(handle.from), " m outside the mesh, must be within ", claims.reach(),
                          " m of it"));
    for (const int v : vertices) claims.add(v, handle.is_point() ? kPoint : kBone, std::array{b}, whole);
  }
  for (const auto& edge : handles.cage_edges) claim_cage_part(claims, mesh, handles, edge);
  for (const auto& face : handles.cage_faces) claim_cage_part(claims, mesh, handles, face);

  PrescribedWeights out = claims.rows();
  for (int b = 0; b < handles.count(); ++b)
    if (!(out.weights.col(b).maxCoeff() > 0))
      return invalid(text(field, "[", b, "]"),
                     "has no vertex of its own: all along it belong to points or cages; the mesh must be finer");
  return out;
}

}  // namespace crumple::authoring
