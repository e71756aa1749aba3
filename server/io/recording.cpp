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

Result<void> Recording::write_topology(const Topology& topology) {
  if (const auto what = too_long(topology)) return std::unexpected(Error{ErrorCode::resource_exhausted, file_.string(), *what});
  const std::optional<std::uint32_t> base = reference_ ? std::optional(reference_->epoch()) : std::nullopt;
  const std::vector<std::string> parts = encode(topology, base, Codec::quantised16, true);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    v1::WatchResponse message;
    v1::TopologyUpdate& update = *message.mutable_topology();
    update.set_epoch(topology.epoch);
    if (base) update.set_base(*base);
    update.set_part(static_cast<std::uint32_t>(k));
    update.set_parts(static_cast<std::uint32_t>(parts.size()));
    update.set_payload(parts[k]);
    if (auto written = write(message.SerializeAsString()); !written) return written;
  }
  reference_ = FrameReference::of_sender(topology, reference_ ? &*reference_ : nullptr);
  return {};
}

Result<void> Recording::write_frame(const sim::World& world) {
  if (!reference_ || reference_->epoch() != world.topology().epoch) {
    if (auto written = write_topology(world.topology()); !written) return written;
  }
  const Frame frame = world.capture();
  v1::WatchResponse message;
  v1::FrameUpdate& update = *message.mutable_frame();
  update.set_step(frame.step);
  update.set_time(frame.time);
  update.set_epoch(frame.epoch);
  update.set_payload(encode(frame, *reference_, Codec::quantised16, true));
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
