#include "server/authoring/embedded_skinning.h"

#include "server/sim/mesh/embedding.h"

#include <cassert>

namespace crumple::authoring {

EmbeddedSkinning::EmbeddedSkinning(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, std::span<const Vec3> points)
    : start_(1, 0), pivots_(W.cols(), Vec3::Zero()) {
  assert(W.rows() == mesh.node_count());
  const sim::Embedding carried = sim::embed(points, mesh);
  for (size_t v = 0; v < points.size(); ++v) {
    const Tet& tet = mesh.tets[carried.tet[v]];
    for (int b = 0; b < W.cols(); ++b) {
      Term term{b, 0, Vec3::Zero()};
      for (int k = 0; k < 4; ++k) {
        const double c = carried.weights[v][k] * W(tet[k], b);
        term.w += c;
        term.Y += c * mesh.X[tet[k]];
      }
      if (term.w != 0 || !term.Y.isZero(0)) terms_.push_back(term);
    }
    start_.push_back(static_cast<int>(terms_.size()));
  }
  choose_pivots();
}

EmbeddedSkinning::EmbeddedSkinning(const sim::TetMesh& mesh, const Eigen::MatrixXd& W)
    : start_(1, 0), pivots_(W.cols(), Vec3::Zero()) {
  assert(W.rows() == mesh.node_count());
  for (int i = 0; i < mesh.node_count(); ++i) {
    for (int b = 0; b < W.cols(); ++b)
      if (W(i, b) != 0) terms_.push_back({b, W(i, b), W(i, b) * mesh.X[i]});
    start_.push_back(static_cast<int>(terms_.size()));
  }
  choose_pivots();
}

void EmbeddedSkinning::choose_pivots() {
  std::vector<double> w2(pivots_.size(), 0);
  for (const Term& term : terms_) {
    pivots_[term.handle] += term.w * term.Y;
    w2[term.handle] += term.w * term.w;
  }
  for (size_t b = 0; b < pivots_.size(); ++b)
    if (w2[b] > 0) pivots_[b] /= w2[b];
  for (Term& term : terms_) term.Y -= term.w * pivots_[term.handle];
}

std::vector<HandleMotion> EmbeddedSkinning::rest() const {
  std::vector<HandleMotion> out;
  for (const Vec3& pivot : pivots_) out.push_back({Mat3::Identity(), pivot});
  return out;
}

Vec3 EmbeddedSkinning::position(int v, std::span<const HandleMotion> motions) const {
  Vec3 x = Vec3::Zero();
  for (const Term& term : terms(v)) x += motions[term.handle].R * term.Y + term.w * motions[term.handle].s;
  return x;
}

}  // namespace crumple::authoring
