#pragma once

#include "common/frame_codec.h"

namespace crumple {

// What one reader knows of a world from the messages of its stream, live or recorded: the topology that they build up, body by body,
// and the frames that belong to it. A frame of another epoch is an error, never positions of the wrong vertices.
class StreamDecoder {
 public:
  // True: topology() is now the message's. False: it comes in parts, and this was not the last. On errors topology() stays, and later
  // messages that build on what is missing are errors, too: bytes that decode_topology_part refuses; a part that does not follow
  // the one before; a base that is not the epoch of topology(); bodies that are not all there, or one that is new.
  Result<bool> take_topology(std::string_view bytes);

  Result<Frame> decode_frame(std::string_view bytes) const;  // errors: crumple::decode_frame's; no topology yet

  const Topology& topology() const { return topology_; }  // complete; of the bodies, those changed last have its epoch

 private:
  Result<void> complete(TopologyPart whole);

  std::optional<TopologyPart> pending_;  // the parts so far as one
  bool any_ = false;
  Topology topology_;
  FrameReference reference_;
};

}  // namespace crumple
