#include "server/grpc/watch_message.h"

#include <gtest/gtest.h>

#include <vector>

namespace crumple::grpc_server {
namespace {

std::string joined(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(bytes.Dump(&slices).ok());
  std::string all;
  for (const grpc::Slice& slice : slices) all.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return all;
}

runtime::FrameDelivery frame_of(std::size_t payload_bytes) {
  Frame frame{.step = 42, .time = 0.35, .epoch = 3, .step_ms = 1.5, .real_time_factor = 0.9};
  const auto topology = std::make_shared<runtime::PublishedTopology>(Topology{.epoch = 3});
  return {std::make_shared<runtime::PublishedFrame>(frame, false, topology),
          std::make_shared<const std::string>(payload_bytes, 'p')};
}

// Lengths around the varint's steps.
TEST(WatchMessage, FrameIsTheMessageThatProtobufWrites) {
  for (const std::size_t bytes : {0u, 1u, 80u, 127u, 128u, 16383u, 16384u, 3'000'000u}) {
    v1::WatchResponse message;
    message.mutable_frame()->set_step(42);
    message.mutable_frame()->set_time(0.35);
    message.mutable_frame()->set_epoch(3);
    message.mutable_frame()->set_step_ms(1.5);
    message.mutable_frame()->set_real_time_factor(0.9);
    message.mutable_frame()->set_payload(std::string(bytes, 'p'));
    v1::WatchResponse parsed;
    ASSERT_TRUE(parsed.ParseFromString(joined(to_bytes(frame_of(bytes)))));
    EXPECT_EQ(parsed.SerializeAsString(), message.SerializeAsString()) << bytes;
  }
}

TEST(WatchMessage, PayloadIsNotCopied) {
  const runtime::FrameDelivery frame = frame_of(100'000);
  const grpc::ByteBuffer bytes = to_bytes(frame);
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(bytes.Dump(&slices).ok());
  EXPECT_EQ(static_cast<const void*>(slices.back().begin()), frame.payload->data());
  EXPECT_GE(frame.payload.use_count(), 2);  // the message keeps it alive
}

TEST(WatchMessage, EventsAndGapsAndTopologiesParse) {
  const auto event = std::make_shared<const sim::Event>(
      sim::Event{.sequence = 7, .step = 3, .kind = sim::EventKind::dent, .body = 2, .magnitude = 5, .message = "dented"});
  v1::WatchResponse message;
  ASSERT_TRUE(message.ParseFromString(joined(to_bytes(event))));
  EXPECT_EQ(message.event().sequence(), 7u);
  EXPECT_EQ(message.event().kind(), v1::Event::DENT);
  EXPECT_EQ(message.event().message(), "dented");
  ASSERT_TRUE(message.ParseFromString(joined(to_bytes(EventGap{4, 9}))));
  EXPECT_EQ(message.gap().last(), 9u);
  ASSERT_TRUE(message.ParseFromString(joined(to_bytes(runtime::TopologyDelivery{5, 3, 1, 2, std::make_shared<const std::string>("t")}))));
  EXPECT_EQ(message.topology().epoch(), 5u);
  EXPECT_EQ(message.topology().base(), 3u);
  EXPECT_EQ(message.topology().part(), 1u);
  EXPECT_EQ(message.topology().parts(), 2u);
  EXPECT_EQ(message.topology().payload(), "t");
  ASSERT_TRUE(message.ParseFromString(joined(to_bytes(runtime::TopologyDelivery{.epoch = 5, .payload = std::make_shared<const std::string>("t")}))));
  EXPECT_FALSE(message.topology().has_base());  // it has all bodies
}

TEST(WatchMessage, BytesThatAreNoRequestAreRefused) {
  v1::WatchRequest request;
  const grpc::Slice bad(std::string("\xff\xff\xff"));
  EXPECT_FALSE(parse(grpc::ByteBuffer(&bad, 1), request));
}

}  // namespace
}  // namespace crumple::grpc_server
