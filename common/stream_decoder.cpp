#include "common/stream_decoder.h"

#include "common/text.h"

#include <iterator>
#include <utility>

namespace crumple {

Result<bool> StreamDecoder::take_topology(std::string_view bytes) {
  auto part = decode_topology_part(bytes);
  std::optional<TopologyPart> before = std::exchange(pending_, {});
  if (!part) return std::unexpected(part.error());
  if (part->part > 0) {
    const bool follows = before && before->epoch == part->epoch && before->base == part->base && before->parts == part->parts &&
                         before->part + 1 == part->part;
    if (!follows) return invalid("part", text("is ", part->part, " of epoch ", part->epoch, ", the one before is missing"));
    before->part = part->part;
    std::ranges::move(part->bodies, std::back_inserter(before->bodies));
    part = *std::move(before);
  }
  if (part->part + 1 < part->parts) {
    pending_ = *std::move(part);
    return false;
  }
  if (auto done = complete(*std::move(part)); !done) return std::unexpected(done.error());
  return true;
}

Result<void> StreamDecoder::complete(TopologyPart whole) {
  if (!whole.base) {
    for (std::size_t b = 0; b < whole.bodies.size(); ++b)
      if (whole.bodies[b].id != b) return invalid(text("bodies[", b, "].id"), text("is ", whole.bodies[b].id, ", must be ", b));
    topology_ = {whole.epoch, std::move(whole.bodies)};
    reference_ = FrameReference::of_receiver(topology_);
    any_ = true;
    return {};
  }
  if (!any_ || topology_.epoch != *whole.base)
    return invalid("base", text("is ", *whole.base, any_ ? text(", must be ", topology_.epoch, ", the epoch of the topology")
                                                         : std::string(", but there is no topology yet")));
  for (std::size_t b = 0; b < whole.bodies.size(); ++b)
    if (whole.bodies[b].id >= topology_.bodies.size())
      return invalid(text("bodies[", b, "].id"), text("is ", whole.bodies[b].id, ", must be below ", topology_.bodies.size()));
  topology_.epoch = whole.epoch;
  for (BodyTopology& body : whole.bodies) topology_.bodies[body.id] = std::move(body);
  reference_ = FrameReference::of_receiver(topology_, &reference_);
  return {};
}

Result<Frame> StreamDecoder::decode_frame(std::string_view bytes) const {
  if (!any_) return invalid("epoch", "is of a topology that did not come");
  return crumple::decode_frame(bytes, reference_);
}

}  // namespace crumple
