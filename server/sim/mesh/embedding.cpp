#include "server/sim/mesh/embedding.h"

#include "server/sim/mesh/tet_tree.h"

#include <cassert>

namespace crumple::sim {

Embedding embed(std::span<const Vec3> vertices, const TetMesh& mesh) {
  const TetTree tree(mesh);
  Embedding embedding;
  embedding.tet.reserve(vertices.size());
  embedding.weights.reserve(vertices.size());
  for (const Vec3& vertex : vertices) {
    const int t = tree.nearest(vertex).tet;
    embedding.tet.push_back(t);
    embedding.weights.push_back(barycentric(rest_corners(mesh, t), vertex));
  }
  return embedding;
}

void embedded_positions(const Embedding& embedding, const std::vector<Tet>& tets, std::span<const Vec3> x,
                        std::span<Vec3> out) {
  assert(out.size() == embedding.tet.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    const Tet& tet = tets[embedding.tet[v]];
    const Eigen::Vector4d& w = embedding.weights[v];
    out[v] = w[0] * x[tet[0]] + w[1] * x[tet[1]] + w[2] * x[tet[2]] + w[3] * x[tet[3]];
  }
}

}  // namespace crumple::sim
