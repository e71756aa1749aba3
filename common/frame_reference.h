#pragma once

#include "common/position_codec.h"

#include <memory>
#include <vector>

namespace crumple {

// What the positions of frames of one epoch are told from: one PositionReference a body, by BodyId.
class FrameReference {
 public:
  FrameReference() = default;
  // As a reader of quantised16 will have it who is sent this topology; as one has it who was. Bodies that are as in `before`, an
  // older reference of the same side and world, are taken from there.
  static FrameReference of_sender(const Topology& topology, const FrameReference* before = nullptr);
  static FrameReference of_receiver(const Topology& topology, const FrameReference* before = nullptr);

  std::uint32_t epoch() const { return epoch_; }
  const PositionReference* find(BodyId body) const { return body < bodies_.size() ? bodies_[body].get() : nullptr; }

 private:
  std::uint32_t epoch_ = 0;
  std::vector<std::shared_ptr<const PositionReference>> bodies_;
};

}  // namespace crumple
