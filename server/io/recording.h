#pragma once

#include "common/error.h"
#include "server/sim/event.h"
#include "server/sim/world.h"

#include <filesystem>
#include <fstream>

namespace crumple::io {

// The frames and events of a run in one file: what a client that watches would have received, each a
// crumple.v1.WatchResponse (simulation.proto) behind its length as a protobuf varint. `crumple` writes and reads the same.
class Recording {
 public:
  // Replaces an older file. Error: it cannot be written.
  static Result<Recording> create(const std::filesystem::path& file);

  // The world's frame now; before it the topology if that is another than the last frame's.
  Result<void> write_frame(const sim::World& world);
  Result<void> write_event(const sim::Event& event);
  Result<void> finish();  // flushes; nothing may follow

 private:
  Result<void> write(const std::string& message);
  std::filesystem::path file_;
  std::ofstream out_;
  bool any_topology_ = false;
  std::uint32_t epoch_ = 0;
};

}  // namespace crumple::io
