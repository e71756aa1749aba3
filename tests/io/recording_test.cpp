#include "server/io/recording.h"

#include <google/protobuf/io/coded_stream.h>
#include <gtest/gtest.h>

#include "common/stream_decoder.h"
#include "crumple/v1/simulation.pb.h"
#include "tests/support/tearing_bars.h"
#include "tests/support/temporary_folder.h"

namespace crumple::io {
namespace {

std::vector<v1::WatchResponse> read_back(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  google::protobuf::io::CodedInputStream coded(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  std::vector<v1::WatchResponse> messages;
  std::uint64_t length = 0;
  while (coded.ReadVarint64(&length)) {
    std::string message;
    EXPECT_TRUE(coded.ReadString(&message, static_cast<int>(length)));
    EXPECT_TRUE(messages.emplace_back().ParseFromString(message));
  }
  EXPECT_EQ(coded.CurrentPosition(), static_cast<int>(bytes.size()));
  return messages;
}

TEST(Recording, ReadsBackAsWhatAViewerWouldHaveSeen) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "recording.crumple";
  auto world = *sim::World::create(test::tearing_bars(1));
  std::vector<Frame> frames{world->capture()};
  std::vector<sim::Event> events;
  {
    auto recording = Recording::create(file);
    ASSERT_TRUE(recording) << recording.error().text();
    ASSERT_TRUE(recording->write_frame(*world));
    for (int k = 0; k < 12; ++k) {
      world->step();
      for (const sim::Event& event : world->take_events()) {
        events.push_back(event);
        ASSERT_TRUE(recording->write_event(event));
      }
      frames.push_back(world->capture());
      ASSERT_TRUE(recording->write_frame(*world));
    }
    ASSERT_TRUE(recording->finish());
  }
  ASSERT_GT(world->topology().epoch, 0u) << "the bar must break for this test to say anything";

  std::size_t next_frame = 0, next_event = 0, topologies = 0;
  StreamDecoder reader;
  const Topology& topology = reader.topology();
  for (const v1::WatchResponse& message : read_back(file)) {
    if (message.has_topology()) {
      const auto whole = reader.take_topology(message.topology().payload());
      ASSERT_TRUE(whole) << whole.error().text();
      EXPECT_TRUE(*whole);
      EXPECT_EQ(topology.epoch, message.topology().epoch());
      EXPECT_EQ(message.topology().has_base(), topologies > 0);
      const auto part = decode_topology_part(message.topology().payload());
      EXPECT_EQ(part->bodies.size(), topologies > 0 ? 1u : 2u);  // the ball never breaks
      ++topologies;
    } else if (message.has_event()) {
      ASSERT_LT(next_event, events.size());
      EXPECT_EQ(message.event().sequence(), events[next_event].sequence);
      EXPECT_EQ(message.event().message(), events[next_event].message);
      ++next_event;
    } else {
      ASSERT_TRUE(message.has_frame());
      ASSERT_LT(next_frame, frames.size());
      const Frame& seen = frames[next_frame++];
      const auto decoded = reader.decode_frame(message.frame().payload());
      ASSERT_TRUE(decoded) << decoded.error().text();
      EXPECT_EQ(decoded->step, seen.step);
      EXPECT_EQ(message.frame().step(), seen.step);
      EXPECT_EQ(decoded->time, seen.time);
      EXPECT_EQ(decoded->epoch, topology.epoch) << "a frame's topology stands before it";
      ASSERT_EQ(decoded->bodies.size(), 2u);
      ASSERT_EQ(decoded->bodies[0].positions.size(), seen.bodies[0].positions.size());
      ASSERT_EQ(decoded->bodies[0].positions.size(), topology.bodies[0].vertices.size());
      for (std::size_t v = 0; v < seen.bodies[0].positions.size(); ++v) {
        EXPECT_LT((decoded->bodies[0].positions[v] - seen.bodies[0].positions[v]).norm(), 1e-4);  // 16 bits of a box of 1 m
      }
      EXPECT_LT((decoded->bodies[1].pose.p_WB - seen.bodies[1].pose.p_WB).norm(), 1e-6);
    }
  }
  EXPECT_EQ(next_frame, frames.size());
  EXPECT_EQ(next_event, events.size());
  EXPECT_GE(topologies, 2u);
  EXPECT_LT(topologies, frames.size());  // once an epoch, not once a frame
}

TEST(Recording, AFileThatCannotBeWrittenIsAnError) {
  const test::TemporaryFolder folder;
  const auto recording = Recording::create(folder.path() / "none" / "recording.crumple");
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::unavailable);
}

TEST(Recording, AFullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  auto world = *sim::World::create(test::tearing_bars(1));
  auto recording = Recording::create("/dev/full");
  ASSERT_TRUE(recording);
  bool failed = false;
  for (int k = 0; k < 50 && !failed; ++k) failed = !recording->write_frame(*world);
  EXPECT_TRUE(failed || !recording->finish());
}

}  // namespace
}  // namespace crumple::io
