#pragma once

#include "common/error.h"
#include "common/frame_reference.h"
#include "server/sim/event.h"
#include "server/sim/world.h"

#include <filesystem>
#include <fstream>
#include <optional>

namespace crumple::io {

// The frames and events of a run in one file: what a client that watches would have received, each a
// crumple.v1.WatchResponse (simulation.proto) behind its length as a protobuf varint. `crumple` writes and reads the same.
class Recording {
 public:
  // Replaces an older file. Error: it cannot be written.
  static Result<Recording> create(const std::filesystem::path& file);

  // The world's frame now; before it what changed of the topology since the last frame. Error resource_exhausted: too long for a message.
  Result<void> write_frame(const sim::World& world);
  Result<void> write_event(const sim::Event& event);
  Result<void> finish();  // flushes; nothing may follow

 private:
  Result<void> write(const std::string& message);
  Result<void> write_topology(const Topology& topology);
  std::filesystem::path file_;
  std::ofstream out_;
  std::optional<FrameReference> reference_;  // of the last topology written
};

}  // namespace crumple::io
