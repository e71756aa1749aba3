#include "server/sim/fracture/fragments.h"

#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_faces.h"

#include <numeric>

namespace crumple::sim::fracture {

Fragments find_fragments(std::span<const Tet> tets) {
  std::vector<int> parent(tets.size());
  std::iota(parent.begin(), parent.end(), 0);
  const std::vector<FaceOfTet> faces = sorted_faces(tets);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].same_face(faces[i - 1])) unite(parent, faces[i - 1].tet, faces[i].tet);
  }
  Fragments fragments;
  fragments.of_tet.resize(tets.size());
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const int r = find_root(parent, t);
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
