#include "server/io/recording.h"

#include "common/frame_codec.h"
#include "server/scene_convert/event_convert.h"

#include <google/protobuf/io/coded_stream.h>

namespace crumple::io {

Result<Recording> Recording::create(const std::filesystem::path& file) {
  Recording recording;
  recording.file_ = file;
  recording.out_.open(file, std::ios::binary | std::ios::trunc);
  if (!recording.out_) return std::unexpected(Error{ErrorCode::unavailable, file.string(), "cannot be written"});
  return recording;
}

Result<void> Recording::write(const std::string& message) {
  std::uint8_t length[10];
  const std::uint8_t* end = google::protobuf::io::CodedOutputStream::WriteVarint64ToArray(message.size(), length);
  out_.write(reinterpret_cast<const char*>(length), end - length);
  out_.write(message.data(), static_cast<std::streamsize>(message.size()));
  if (!out_) return std::unexpected(Error{ErrorCode::unavailable, file_.string(), "cannot be written: the disk is full or gone"});
  return {};
}

Result<void> Recording::write_frame(const sim::World& world) {
  const Topology& topology = world.topology();
  if (!any_topology_ || topology.epoch != epoch_) {
    v1::WatchResponse message;
    message.mutable_topology()->set_epoch(topology.epoch);
    message.mutable_topology()->set_payload(encode(topology, Codec::quantised16, true));
    if (auto written = write(message.SerializeAsString()); !written) return written;
    any_topology_ = true;
    epoch_ = topology.epoch;
  }
  const Frame frame = world.capture();
  v1::WatchResponse message;
  v1::FrameUpdate& update = *message.mutable_frame();
  update.set_step(frame.step);
  update.set_time(frame.time);
  update.set_epoch(frame.epoch);
  update.set_payload(encode(frame, Codec::quantised16, true));
  return write(message.SerializeAsString());
}

Result<void> Recording::write_event(const sim::Event& event) {
  v1::WatchResponse message;
  *message.mutable_event() = scene_convert::to_message(event);
  return write(message.SerializeAsString());
}

Result<void> Recording::finish() {
  out_.close();
  if (!out_) return std::unexpected(Error{ErrorCode::unavailable, file_.string(), "cannot be written: the disk is full or gone"});
  return {};
}

}  // namespace crumple::io
