#include "server/sim/bodies/soft_skin.h"

#include <algorithm>
#include <utility>

namespace crumple::sim {

Result<SoftSkin> SoftSkin::make(const FemModel& model, bool breakable, const SharedFaces& faces) {
  SoftSkin skin;
  if (model.splinters) {
    skin.splinters_ = model.splinters;
    auto carried = SplinterEmbedding::make(*model.splinters, *model.mesh, faces);
    if (!carried) return invalid("splinters", carried.error().message);
    skin.carried_ = *std::move(carried);
  } else if (model.render && !breakable) {
    skin.embedding_ = embed(model.render->vertices, *model.mesh);
    skin.triangles_ = model.render->triangles;
  } else {
    skin.draws_tets_ = true;
  }
  return skin;
}

void SoftSkin::rebuild(const SoftShape& shape, const SharedFaces& faces, std::span<const int> parted) {
  if (carried_) {
    carried_->follow(faces, parted);
    draw_splinters();
  } else if (draws_tets_) {
    draw_tets(shape);
  }
}

// What nobody sees is left out, and what is at the same place in the same tet is one vertex.
void SoftSkin::draw_splinters() {
  const SplinterMesh& mesh = *splinters_;
  const Embedding& at = carried_->vertices();
  triangles_.clear();
  embedding_ = {};
  std::vector<int> first(mesh.surface.vertices.size(), -1), next;  // drawn vertices at the place of the lowest, in other tets each
  const auto draw = [&](int v) {
    const int lowest = carried_->twin(v);
    for (int id = first[lowest]; id >= 0; id = next[id])
      if (embedding_.tet[id] == at.tet[v]) return id;
    const int id = static_cast<int>(next.size());
    next.push_back(std::exchange(first[lowest], id));
    embedding_.tet.push_back(at.tet[v]);
    embedding_.weights.push_back(at.weights[v]);
    return id;
  };
  std::vector<char> hidden(mesh.patches.size());
  for (std::size_t p = 0; p < hidden.size(); ++p) hidden[p] = carried_->is_hidden(static_cast<int>(p));
  for (std::size_t t = 0; t < mesh.surface.triangles.size(); ++t) {
    if (mesh.patch[t] >= 0 && hidden[mesh.patch[t]]) continue;
    Triangle triangle = mesh.surface.triangles[t];
    for (int& v : triangle) v = draw(v);
    triangles_.push_back(triangle);
  }
}

void SoftSkin::draw_tets(const SoftShape& shape) {
  nodes_.clear();
  triangles_.clear();
  std::vector<int> drawn;
  for (int piece = 0; piece < static_cast<int>(shape.pieces.size()); ++piece) {
    drawn.assign(shape.x(piece).size(), -1);
    const std::size_t first = triangles_.size();
    contact::append_surface(shape.collision(piece), triangles_);
    for (const Triangle& triangle : std::span(triangles_).subspan(first))
      for (int n : triangle) drawn[n] = 0;
    for (std::size_t n = 0; n < drawn.size(); ++n) {
      if (drawn[n] < 0) continue;
      drawn[n] = static_cast<int>(nodes_.size());
      nodes_.push_back({piece, static_cast<int>(n)});
    }
    for (Triangle& triangle : std::span(triangles_).subspan(first)) {
      for (int& n : triangle) n = drawn[n];
    }
  }
}

void SoftSkin::follow(int piece, std::span<const NodeRef> moved) {
  for (NodeRef& at : nodes_)
    if (at.piece == piece) at = moved[at.node];
}

void SoftSkin::capture(const SoftShape& shape, std::span<const std::vector<float>> node_values, BodyFrame& frame) const {
  const auto value = [&](NodeRef at) { return node_values[at.piece].empty() ? 0.0f : node_values[at.piece][at.node]; };
  for (const NodeRef& at : nodes_) {
    frame.positions.push_back(shape.position(at).cast<float>());
    if (!node_values.empty()) frame.values.push_back(value(at));
  }
  for (std::size_t v = 0; v < embedding_.tet.size(); ++v) {
    const TetRef at = shape.scene_tets[embedding_.tet[v]];
    const Tet& tet = shape.nodes(at);
    const Eigen::Vector4d& w = embedding_.weights[v];
    Mat34 corners;
    for (int k = 0; k < 4; ++k) corners.col(k) = shape.position({at.piece, tet[k]});
    frame.positions.push_back((corners * w).cast<float>());
    if (node_values.empty()) continue;
    float sum = 0;
    for (int k = 0; k < 4; ++k) sum += static_cast<float>(w[k]) * value({at.piece, tet[k]});
    frame.values.push_back(std::clamp(sum, 0.0f, 1.0f));
  }
}

}  // namespace crumple::sim
