#include "common/frame_reference.h"

namespace crumple {
namespace {

PositionReference reference_of(const BodyTopology& body) {
  if (!body.deformable) return {.epoch = body.epoch};  // moves by its pose
  return {body.epoch, body.vertices, drawn_pieces(body)};
}

}  // namespace

FrameReference FrameReference::of_receiver(const Topology& topology, const FrameReference* before) {
  FrameReference reference;
  reference.epoch_ = topology.epoch;
  for (const BodyTopology& body : topology.bodies) {
    const std::size_t id = reference.bodies_.size();
    const bool same = before && id < before->bodies_.size() && before->bodies_[id]->epoch == body.epoch;
    reference.bodies_.push_back(same ? before->bodies_[id] : std::make_shared<const PositionReference>(reference_of(body)));
  }
  return reference;
}

FrameReference FrameReference::of_sender(const Topology& topology, const FrameReference* before) {
  FrameReference reference = of_receiver(topology, before);
  for (std::size_t id = 0; id < reference.bodies_.size(); ++id) {
    auto& body = reference.bodies_[id];
    if (before && id < before->bodies_.size() && body == before->bodies_[id]) continue;
    auto sent = std::make_shared<PositionReference>(*body);
    sent->X = quantised(sent->X);
    body = std::move(sent);
  }
  return reference;
}

}  // namespace crumple
