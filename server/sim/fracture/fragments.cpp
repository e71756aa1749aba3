#include "server/sim/fracture/fragments.h"

#include "server/sim/mesh/tet_faces.h"

#include <numeric>
#include <utility>

namespace crumple::sim::fracture {

Fragments find_fragments(std::span<const Tet> tets) {
  // Union-find in which every tree hangs from its lowest tet.
  std::vector<int> parent(tets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
  };
  const std::vector<FaceOfTet> faces = sorted_faces(tets);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (!faces[i].same_face(faces[i - 1])) continue;
    int a = root(faces[i - 1].tet), b = root(faces[i].tet);
    if (a > b) std::swap(a, b);
    parent[b] = a;
  }
  Fragments fragments;
  fragments.of_tet.resize(tets.size());
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const int r = root(t);
    if (r == t) {
      fragments.of_tet[t] = fragments.count();
      fragments.size.push_back(0);
    } else {
      fragments.of_tet[t] = fragments.of_tet[r];  // r < t
    }
    ++fragments.size[fragments.of_tet[t]];
  }
  return fragments;
}

}  // namespace crumple::sim::fracture
