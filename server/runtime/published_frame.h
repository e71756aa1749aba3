#pragma once

#include "common/frame.h"
#include "common/frame_codec.h"

#include <compare>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crumple::runtime {

using Payload = std::shared_ptr<const std::string>;  // encoded bytes, shared by all who send them

// How a reader wants its frames. Readers of one format share one encoding.
struct StreamFormat {
  Codec codec = Codec::quantised16;
  bool compress = true;
  bool values = false;  // BodyFrame::values

  auto operator<=>(const StreamFormat&) const = default;
};

// Encodes at most once per key; who asks while another encodes waits for that one. Thread-safe.
template <class Key, class Encoded>
class EncodeOnce {
 public:
  Encoded get(const Key& key, const std::function<Encoded()>& encode) const {
    std::shared_ptr<Slot> slot;
    {
      const std::lock_guard lock(mutex_);
      auto& entry = slots_[key];
      if (!entry) entry = std::make_shared<Slot>();
      slot = entry;
    }
    std::call_once(slot->once, [&] { slot->encoded = encode(); });
    return slot->encoded;
  }

 private:
  struct Slot {
    std::once_flag once;
    Encoded encoded;
  };
  mutable std::mutex mutex_;
  mutable std::map<Key, std::shared_ptr<Slot>> slots_;
};

// A topology on its way to many readers.
class PublishedTopology {
 public:
  // before: of the same world, or none; what has not changed since is not worked out again. max_content: of a message [bytes].
  explicit PublishedTopology(Topology topology, const PublishedTopology* before = nullptr, std::size_t max_content = kMaxContentBytes);
  const Topology& topology() const { return topology_; }
  const FrameReference& reference() const { return reference_; }
  // What a reader of the topology of epoch `since` lacks; nothing: of none. One message or more, to be sent in this order.
  std::vector<Payload> encoded(const StreamFormat& format, std::optional<std::uint32_t> since) const;

 private:
  Topology topology_;
  FrameReference reference_;
  std::size_t max_content_;
  EncodeOnce<std::pair<StreamFormat, std::optional<std::uint32_t>>, std::vector<Payload>> encodings_;
};

// A frame on its way to many readers, with the topology it belongs to.
class PublishedFrame {
 public:
  // `with_values`: the frame was captured with values.
  PublishedFrame(Frame frame, bool with_values, std::shared_ptr<const PublishedTopology> topology);
  const Frame& frame() const { return frame_; }
  const std::shared_ptr<const PublishedTopology>& topology() const { return topology_; }
  bool serves(const StreamFormat& format) const { return with_values_ || !format.values; }
  Payload encoded(const StreamFormat& format) const;  // must serve it

 private:
  Frame frame_;
  bool with_values_;
  std::shared_ptr<const PublishedTopology> topology_;
  EncodeOnce<StreamFormat, Payload> encodings_;
};

}  // namespace crumple::runtime
