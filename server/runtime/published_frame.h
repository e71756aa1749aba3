#pragma once

#include "common/frame.h"
#include "common/frame_codec.h"

#include <compare>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace crumple::runtime {

using Payload = std::shared_ptr<const std::string>;  // encoded bytes, shared by all who send them

// How a reader wants its frames. Readers of one format share one encoding.
struct StreamFormat {
  Codec codec = Codec::quantised16;
  bool compress = true;
  bool values = false;  // one value a vertex

  auto operator<=>(const StreamFormat&) const = default;
};

// Encodes at most once per format; who asks while another encodes waits for that one. Thread-safe.
class EncodeOnce {
 public:
  Payload get(const StreamFormat& format, const std::function<std::string()>& encode) const;

 private:
  struct Slot {
    std::once_flag once;
    Payload payload;
  };
  mutable std::mutex mutex_;
  mutable std::map<StreamFormat, std::shared_ptr<Slot>> slots_;
};

// A topology on its way to many readers.
class PublishedTopology {
 public:
  explicit PublishedTopology(Topology topology) : topology_(std::move(topology)) {}
  const Topology& topology() const { return topology_; }
  Payload encoded(const StreamFormat& format) const;

 private:
  Topology topology_;
  EncodeOnce encodings_;
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
  EncodeOnce encodings_;
};

}  // namespace crumple::runtime
