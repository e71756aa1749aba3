#include "server/sim/contact/collision_mesh.h"

#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_faces.h"

#include <cassert>
#include <cmath>
#include <numeric>

namespace crumple::sim::contact {
namespace {

double rest_volume(const Tet& tet, const std::vector<Vec3>& X) {
  const Vec3 o = X[tet[0]];
  return std::abs((X[tet[1]] - o).cross(X[tet[2]] - o).dot(X[tet[3]] - o)) / 6;
}

double face_area(const Tet& tet, int opposite, const std::vector<Vec3>& X) {
  const auto& [a, b, c] = kTetFaces[opposite];
  return 0.5 * (X[tet[b]] - X[tet[a]]).cross(X[tet[c]] - X[tet[a]]).norm();
}

}  // namespace

CollisionMesh make_collision_mesh(const std::vector<Tet>& tets, const std::vector<Vec3>& X,
                                  std::span<const double> tet_mass) {
  assert(tet_mass.empty() || tet_mass.size() == tets.size());
  const int n = static_cast<int>(tets.size());

  // Faces shared by two tets join them, the others are the surface.
  std::vector<std::uint8_t> exterior(n, 0);
  std::vector<int> parent(n);
  std::iota(parent.begin(), parent.end(), 0);
  const std::vector<FaceOfTet> faces = sorted_faces(tets);
  for (std::size_t f = 0; f < faces.size();) {
    std::size_t end = f + 1;
    while (end < faces.size() && faces[end].same_face(faces[f])) ++end;
    if (end == f + 1) exterior[faces[f].tet] |= static_cast<std::uint8_t>(1 << faces[f].opposite);
    for (std::size_t g = f + 1; g < end; ++g) unite(parent, faces[f].tet, faces[g].tet);
    f = end;
  }

  std::vector<int> component(n), order(n);
  std::vector<int> next;  // of each component, where its next boundary tet and its next other one go
  int components = 0;
  for (int t = 0; t < n; ++t) {
    const int r = find_root(parent, t);  // the component's lowest tet
    component[t] = r == t ? components++ : component[r];
    if (r == t) next.insert(next.end(), 2, 0);
    ++next[2 * component[t] + (exterior[t] == 0)];
  }
  std::exclusive_scan(next.begin(), next.end(), next.begin(), 0);
  for (int t = 0; t < n; ++t) order[next[2 * component[t] + (exterior[t] == 0)]++] = t;

  CollisionMesh mesh;
  mesh.tets.reserve(n);
  mesh.components.reserve(components);
  for (const int t : order) {
    const int position = static_cast<int>(mesh.tets.size());
    if (component[t] == static_cast<int>(mesh.components.size())) mesh.components.push_back({.begin = position, .boundary_end = position, .end = position});
    CollisionComponent& part = mesh.components.back();
    mesh.tets.push_back({t, tets[t], exterior[t]});
    part.end = position + 1;
    if (exterior[t] != 0) part.boundary_end = position + 1;
    part.volume += rest_volume(tets[t], X);
    if (!tet_mass.empty()) part.mass += tet_mass[t];
    for (int k = 0; k < 4; ++k)
      if (exterior[t] >> k & 1) part.thickness += face_area(tets[t], k, X);  // the area, so far
  }
  std::vector<int> listed_for(X.size(), -1);
  for (int c = 0; c < components; ++c) {
    CollisionComponent& part = mesh.components[c];
    part.first_node = static_cast<int>(mesh.nodes.size());
    for (int k = part.begin; k < part.end; ++k)
      for (const int node : mesh.tets[k].nodes) {
        if (listed_for[node] == c) continue;
        listed_for[node] = c;
        mesh.nodes.push_back(node);
      }
    part.end_node = static_cast<int>(mesh.nodes.size());
  }
  for (CollisionComponent& part : mesh.components) part.thickness = part.thickness > 0 ? 2 * part.volume / part.thickness : 0;
  return mesh;
}

CollisionMesh kept_components(const CollisionMesh& mesh, std::span<const int> components, std::span<const int> new_tet,
                              std::span<const int> new_node) {
  CollisionMesh kept;
  for (const int c : components) {
    CollisionComponent part = mesh.components[c];
    const int shift = static_cast<int>(kept.tets.size()) - part.begin;
    const std::span<const int> nodes = mesh.nodes_of(part);
    for (int k = part.begin; k < part.end; ++k) {
      CollisionTet tet = mesh.tets[k];
      tet.id = new_tet[tet.id];
      for (int& node : tet.nodes) node = new_node[node];
      kept.tets.push_back(tet);
    }
    part.begin += shift, part.boundary_end += shift, part.end += shift;
    part.first_node = static_cast<int>(kept.nodes.size());
    for (const int node : nodes) kept.nodes.push_back(new_node[node]);
    part.end_node = static_cast<int>(kept.nodes.size());
    kept.components.push_back(part);
  }
  return kept;
}

void append_surface(const CollisionMesh& mesh, std::vector<Triangle>& triangles) {
  std::vector<int> at(mesh.tets.size());  // of each tet its place
  for (std::size_t k = 0; k < mesh.tets.size(); ++k) at[mesh.tets[k].id] = static_cast<int>(k);
  for (const int place : at) {
    const CollisionTet& tet = mesh.tets[place];
    for (int k = 0; k < 4; ++k)
      if (tet.exterior >> k & 1) triangles.push_back({tet.nodes[kTetFaces[k][0]], tet.nodes[kTetFaces[k][1]], tet.nodes[kTetFaces[k][2]]});
  }
}

}  // namespace crumple::sim::contact
