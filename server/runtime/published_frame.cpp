#include "server/runtime/published_frame.h"

#include <cassert>

namespace crumple::runtime {

Payload EncodeOnce::get(const StreamFormat& format, const std::function<std::string()>& encode) const {
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    auto& entry = slots_[format];
    if (!entry) entry = std::make_shared<Slot>();
    slot = entry;
  }
  std::call_once(slot->once, [&] { slot->payload = std::make_shared<const std::string>(encode()); });
  return slot->payload;
}

Payload PublishedTopology::encoded(const StreamFormat& format) const {
  const StreamFormat without_values{format.codec, format.compress, false};  // they make no difference here
  return encodings_.get(without_values, [&] { return encode(topology_, format.codec, format.compress); });
}

PublishedFrame::PublishedFrame(Frame frame, bool with_values, std::shared_ptr<const PublishedTopology> topology)
    : frame_(std::move(frame)), with_values_(with_values), topology_(std::move(topology)) {
  assert(topology_ && topology_->topology().epoch == frame_.epoch);
}

Payload PublishedFrame::encoded(const StreamFormat& format) const {
  assert(serves(format));
  return encodings_.get(format, [&] {
    if (format.values || !with_values_) return encode(frame_, format.codec, format.compress);
    Frame plain = frame_;
    for (BodyFrame& body : plain.bodies) body.values.clear();
    return encode(plain, format.codec, format.compress);
  });
}

}  // namespace crumple::runtime
