#include "server/runtime/published_frame.h"

#include <cassert>

namespace crumple::runtime {

PublishedTopology::PublishedTopology(Topology topology, const PublishedTopology* before, std::size_t max_content)
    : topology_(std::move(topology)), reference_(FrameReference::of_sender(topology_, before ? &before->reference_ : nullptr)),
      max_content_(max_content) {}

std::vector<Payload> PublishedTopology::encoded(const StreamFormat& format, std::optional<std::uint32_t> since) const {
  const StreamFormat without_values{format.codec, format.compress, false};  // they make no difference here
  return encodings_.get({without_values, since}, [&] {
    std::vector<Payload> payloads;
    for (std::string& message : encode(topology_, since, format.codec, format.compress, max_content_))
      payloads.push_back(std::make_shared<const std::string>(std::move(message)));
    return payloads;
  });
}

PublishedFrame::PublishedFrame(Frame frame, bool with_values, std::shared_ptr<const PublishedTopology> topology)
    : frame_(std::move(frame)), with_values_(with_values), topology_(std::move(topology)) {
  assert(topology_ && topology_->topology().epoch == frame_.epoch);
}

Payload PublishedFrame::encoded(const StreamFormat& format) const {
  assert(serves(format));
  return encodings_.get(format, [&] {
    const auto payload_of = [&](const Frame& frame) {
      return std::make_shared<const std::string>(encode(frame, topology_->reference(), format.codec, format.compress));
    };
    if (format.values || !with_values_) return payload_of(frame_);
    Frame plain = frame_;
    for (BodyFrame& body : plain.bodies) body.values.clear();
    return payload_of(plain);
  });
}

}  // namespace crumple::runtime
