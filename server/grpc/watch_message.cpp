#include "server/grpc/watch_message.h"

#include "server/scene_convert/event_convert.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <array>
#include <cassert>

namespace crumple::grpc_server {
namespace {

using google::protobuf::io::CodedOutputStream;

constexpr std::uint32_t length_delimited(int field_number) { return static_cast<std::uint32_t>(field_number) << 3 | 2; }

// A slice that keeps the payload alive.
grpc::Slice share(const runtime::Payload& payload) {
  auto* owner = new runtime::Payload(payload);
  const auto release = [](void* p) { delete static_cast<runtime::Payload*>(p); };
  return {const_cast<char*>(payload->data()), payload->size(), release, owner};
}

// WatchResponse { update_field: { ...small fields..., payload_field: payload } }, the payload not copied.
grpc::ByteBuffer with_payload(int update_field, const std::string& small_fields, int payload_field,
                              const runtime::Payload& payload) {
  std::string header;
  {
    google::protobuf::io::StringOutputStream stream(&header);
    CodedOutputStream out(&stream);
    const auto size = static_cast<std::uint32_t>(payload->size());
    const std::uint32_t payload_tag = length_delimited(payload_field);
    out.WriteTag(length_delimited(update_field));
    out.WriteVarint32(static_cast<std::uint32_t>(small_fields.size() + CodedOutputStream::VarintSize32(payload_tag) +
                                                 CodedOutputStream::VarintSize32(size)) + size);
    out.WriteString(small_fields);
    out.WriteTag(payload_tag);
    out.WriteVarint32(size);
  }
  const std::array slices{grpc::Slice(header), share(payload)};
  return {slices.data(), slices.size()};
}

grpc::ByteBuffer plain(const v1::WatchResponse& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

struct ToBytes {
  grpc::ByteBuffer operator()(const EventGap& gap) const {
    v1::WatchResponse message;
    message.mutable_gap()->set_first(gap.first);
    message.mutable_gap()->set_last(gap.last);
    return plain(message);
  }
  grpc::ByteBuffer operator()(const runtime::SharedEvent& event) const {
    v1::WatchResponse message;
    *message.mutable_event() = scene_convert::to_message(*event);
    return plain(message);
  }
  grpc::ByteBuffer operator()(const runtime::TopologyDelivery& delivery) const {
    v1::TopologyUpdate update;
    update.set_epoch(delivery.epoch);
    if (delivery.base) update.set_base(*delivery.base);
    update.set_part(delivery.part);
    update.set_parts(delivery.parts);
    return with_payload(v1::WatchResponse::kTopologyFieldNumber, update.SerializeAsString(),
                        v1::TopologyUpdate::kPayloadFieldNumber, delivery.payload);
  }
  grpc::ByteBuffer operator()(const runtime::FrameDelivery& delivery) const {
    const Frame& frame = delivery.frame->frame();
    v1::FrameUpdate update;
    update.set_step(frame.step);
    update.set_time(frame.time);
    update.set_epoch(frame.epoch);
    update.set_step_ms(frame.step_ms);
    update.set_real_time_factor(frame.real_time_factor);
    return with_payload(v1::WatchResponse::kFrameFieldNumber, update.SerializeAsString(),
                        v1::FrameUpdate::kPayloadFieldNumber, delivery.payload);
  }
  grpc::ByteBuffer operator()(const runtime::Closed&) const {
    assert(false);
    return {};
  }
};

}  // namespace

grpc::ByteBuffer to_bytes(const runtime::Delivery& delivery) { return std::visit(ToBytes{}, delivery); }

bool parse(const grpc::ByteBuffer& bytes, v1::WatchRequest& request) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Dump(&slices).ok()) return false;
  std::string joined;
  for (const grpc::Slice& slice : slices) joined.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return request.ParseFromString(joined);
}

}  // namespace crumple::grpc_server
