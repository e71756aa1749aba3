#include "server/sim/mesh/tet_faces.h"

#include <algorithm>
#include <tuple>
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

std::vector<FaceOfTet> sorted_faces(std::span<const Tet> tets) {
  // Counting sort by the lowest node, then each short bucket by comparison: linear in the mesh.
  int node_count = 0;
  for (const Tet& tet : tets) node_count = std::max(node_count, 1 + *std::max_element(tet.begin(), tet.end()));
  const auto each_face = [&](auto&& visit) {
    for (int t = 0; t < static_cast<int>(tets.size()); ++t)
      for (int k = 0; k < 4; ++k) visit(face_of(tets[t], t, k));
  };
  std::vector<std::size_t> begin(node_count + 1, 0);
  each_face([&](const FaceOfTet& face) { ++begin[face.key[0] + 1]; });
  for (int n = 0; n < node_count; ++n) begin[n + 1] += begin[n];

  std::vector<FaceOfTet> faces(4 * tets.size());
  std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
  each_face([&](const FaceOfTet& face) { faces[end[face.key[0]]++] = face; });
  for (int n = 0; n < node_count; ++n) {
    std::sort(faces.begin() + begin[n], faces.begin() + begin[n + 1], [](const FaceOfTet& a, const FaceOfTet& b) {
      return std::tie(a.key[1], a.key[2], a.tet) < std::tie(b.key[1], b.key[2], b.tet);
    });
  }
  return faces;
}

}  // namespace crumple::sim
