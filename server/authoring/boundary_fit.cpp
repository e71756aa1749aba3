#include "server/authoring/boundary_fit.h"

#include "server/authoring/handle_placement.h"
#include "server/authoring/node_mover.h"
#include "server/authoring/solid_fraction.h"
#include "server/authoring/surface_distance.h"
#include "server/authoring/surface_transfer.h"
#include "server/authoring/tet_connectivity.h"
#include "server/sim/mesh/embedding.h"

#include <algorithm>
#include <numeric>

namespace crumple::authoring {
namespace {

// Two rounds, because tets that the first one flattens against the surface and leaves without solid can go.
constexpr double kKeptVolume[] = {0.1, 0.04};  // of a lattice tet's

// Without the tets of less fill than `threshold` that have a neighbour at least half full; unused nodes go as well.
sim::TetMesh without_slivers(const sim::TetMesh& mesh, double threshold) {
  const auto neighbours = face_neighbours(mesh.tets);
  sim::TetMesh out;
  std::vector<int> node_of(mesh.X.size(), -1);
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const bool leans = std::any_of(neighbours[t].begin(), neighbours[t].end(),
                                   [&](int other) { return other >= 0 && mesh.fill[other] >= 0.5; });
    if (mesh.fill[t] < threshold && leans) continue;
    Tet tet;
    for (int k = 0; k < 4; ++k) {
      int& node = node_of[mesh.tets[t][k]];
      if (node < 0) {
        node = out.node_count();
        out.X.push_back(mesh.X[mesh.tets[t][k]]);
      }
      tet[k] = node;
    }
    out.tets.push_back(tet);
    out.fill.push_back(mesh.fill[t]);
  }
  return out;
}

sim::TetMesh trimmed(sim::TetMesh mesh) {
  const int parts = face_parts(face_neighbours(mesh.tets)).count;
  for (const double threshold : {0.3, 0.2, 0.1}) {
    sim::TetMesh out = without_slivers(mesh, threshold);
    if (!out.tets.empty() && face_parts(face_neighbours(out.tets)).count <= parts) return out;
  }
  return mesh;
}

// Extreme points of each connected part of the surface, in the 26 directions of a cube's faces, edges and corners.
std::vector<Vec3> extreme_points(const sim::SurfaceMesh& surface) {
  std::vector<int> root(surface.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& [a, b, c] : surface.triangles) {
    root[find(a)] = find(b);
    root[find(b)] = find(c);
  }
  std::vector<std::vector<int>> parts(surface.vertices.size());
  for (int v = 0; v < static_cast<int>(root.size()); ++v) parts[find(v)].push_back(v);
  std::vector<Vec3> out;
  for (const std::vector<int>& part : parts) {
    if (part.size() < 4) continue;
    for (int code = 0; code < 27; ++code) {
      const Vec3 direction(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
      if (direction.isZero()) continue;
      const auto height = [&](int v) { return direction.dot(surface.vertices[v]); };
      out.push_back(surface.vertices[*std::max_element(part.begin(), part.end(),
                                                       [&](int a, int b) { return height(a) < height(b); })]);
    }
  }
  return out;
}

void snap_extremes(sim::TetMesh& mesh, NodeMover& mover, const sim::SurfaceMesh& surface,
                   const std::vector<int>& boundary, double reach) {
  std::vector<char> taken(mesh.X.size(), false);
  for (const Vec3& target : extreme_points(surface)) {
    int best = -1;
    double best_distance = reach;
    for (const int node : boundary)
      if (const double d = (mesh.X[node] - target).norm(); d < best_distance) {
        best_distance = d;
        best = node;
      }
    if (best >= 0 && !taken[best]) taken[best] = mover.try_move(best, target);
  }
}

// Fill of the tets that have a boundary node; the others have not moved.
void sample_fill(sim::TetMesh& mesh, const std::vector<int>& boundary, const WindingNumber& solid) {
  std::vector<char> moved(mesh.X.size(), false);
  for (const int node : boundary) moved[node] = true;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const auto& [a, b, c, d] = mesh.tets[t];
    if (!moved[a] && !moved[b] && !moved[c] && !moved[d]) continue;
    const double fraction = solid_fraction(solid, {mesh.X[a], mesh.X[b], mesh.X[c], mesh.X[d]});
    mesh.fill[t] = std::max(EnclosingOptions{}.minimum_fill, fraction);
  }
}

}  // namespace

std::vector<int> nodes_at_solid(const sim::TetMesh& mesh, const sim::SurfaceMesh& surface, double reach) {
  const SurfaceDistance distance(surface);
  const WindingNumber solid(surface);
  std::vector<int> out;
  for (const int node : surface_nodes(mesh.tets))
    if (distance(mesh.X[node]) <= reach || solid.inside(mesh.X[node])) out.push_back(node);
  return out;
}

sim::TetMesh fitted_to_surface(const EnclosingMesh& enclosing, const sim::SurfaceMesh& surface) {
  constexpr int kSweeps = 4;  // a node that was held back may follow when its neighbours have moved
  const double h = enclosing.report.cell_size;
  const SurfaceDistance distance(surface);
  const WindingNumber solid(surface);
  sim::TetMesh mesh = enclosing.mesh;
  for (const double kept : kKeptVolume) {
    mesh = trimmed(std::move(mesh));
    const std::vector<int> boundary = surface_nodes(mesh.tets);
    NodeMover mover(mesh, kept * h * h * h / 12);
    for (int sweep = 0; sweep < kSweeps; ++sweep)
      for (const int node : boundary) mover.move(node, distance.nearest(mesh.X[node]).point);
    snap_extremes(mesh, mover, surface, boundary, 0.6 * h);
    sample_fill(mesh, boundary, solid);
  }
  return mesh;
}

sim::TetMesh pushed_around_vertices(sim::TetMesh mesh, const sim::SurfaceMesh& surface, double cell_size) {
  constexpr int kSweeps = 60;
  const double h = cell_size, margin = 1e-3 * h;
  const std::vector<int> boundary = surface_nodes(mesh.tets);
  sim::SurfaceMesh hull;
  for (const sim::SurfaceFace& face : sim::surface_faces(mesh.tets)) hull.triangles.push_back(face.nodes);
  std::vector<char> on_boundary(mesh.X.size(), false);
  for (const int node : boundary) on_boundary[node] = true;
  bool pushed = false;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const bool all = sweep % 2 == 1;
    const double kept = (sweep < kSweeps / 3 ? 1 : 0.1) * kKeptVolume[1];
    NodeMover mover(mesh, kept * h * h * h / 12);
    const std::vector<int> outside = outside_vertices(mesh, surface.vertices);
    if (outside.empty()) break;
    pushed = true;
    hull.vertices = mesh.X;
    const SurfaceDistance distance(hull);
    std::vector<Vec3> push(mesh.X.size(), Vec3::Zero());  // the longest that a vertex asks of a node
    for (const int v : outside) {
      const Vec3& p = surface.vertices[v];
      const auto nearest = distance.nearest(p);
      const Triangle& t = hull.triangles[nearest.triangle];
      const Vec3 b = barycentric(nearest.point, {mesh.X[t[0]], mesh.X[t[1]], mesh.X[t[2]]});
      // The least moves, by squares, with sum_k b_k move_k = what is missing.
      const Vec3 missing = (p - nearest.point) * (1 + margin / std::max(nearest.distance, margin));
      for (int k = 0; k < 3; ++k)
        if (const Vec3 move = b[k] / b.squaredNorm() * missing; move.squaredNorm() > push[t[k]].squaredNorm())
          push[t[k]] = move;
    }
    for (const int node : boundary) {
      if (push[node].isZero() || mover.try_move(node, mesh.X[node] + push[node])) continue;
      for (const int t : mover.star(node))  // what is behind it makes room
        for (const int other : mesh.tets[t])
          if (other != node && (all || !on_boundary[other])) mover.move(other, mesh.X[other] + 0.5 * push[node]);
      mover.move(node, mesh.X[node] + push[node]);
    }
  }
  if (pushed) sample_fill(mesh, boundary, WindingNumber(surface));
  return mesh;
}

std::vector<int> outside_vertices(const sim::TetMesh& mesh, const std::vector<Vec3>& vertices) {
  const sim::Embedding embedding = sim::embed(vertices, mesh);
  std::vector<int> out;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (embedding.weights[v].minCoeff() < -1e-6) out.push_back(static_cast<int>(v));
  return out;
}

}  // namespace crumple::authoring
