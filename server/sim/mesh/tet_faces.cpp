#include "server/sim/mesh/tet_faces.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace crumple::sim {

namespace {

FaceOfTet face_of(const Tet& tet, int t, int k) {
  Triangle key{tet[kTetFaces[k][0]], tet[kTetFaces[k][1]], tet[kTetFaces[k][2]]};
  if (key[0] > key[1]) std::swap(key[0], key[1]);
  if (key[1] > key[2]) std::swap(key[1], key[2]);
  if (key[0] > key[1]) std::swap(key[0], key[1]);
  return {key, t, k};
}

}  // namespace

// By counting, from the highest node id to the lowest: no pass disturbs the order of the one before, so that tets stay ascending.
std::vector<FaceOfTet> sorted_faces(std::span<const Tet> tets) {
  int node_count = 0;
  for (const Tet& tet : tets) node_count = std::max(node_count, 1 + *std::max_element(tet.begin(), tet.end()));
  std::vector<FaceOfTet> faces, sorted(4 * tets.size());
  faces.reserve(4 * tets.size());
  for (int t = 0; t < static_cast<int>(tets.size()); ++t)
    for (int k = 0; k < 4; ++k) faces.push_back(face_of(tets[t], t, k));
  std::vector<std::size_t> next(node_count + 1);
  for (int digit = 2; digit >= 0; --digit) {
    std::ranges::fill(next, 0);
    for (const FaceOfTet& face : faces) ++next[face.key[digit] + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (const FaceOfTet& face : faces) sorted[next[face.key[digit]]++] = face;
    faces.swap(sorted);
  }
  return faces;
}

}  // namespace crumple::sim
