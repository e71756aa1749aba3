#include "client/sdk/stream_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace crumple::client {
namespace {

std::shared_ptr<const std::string> bytes(const std::string& text) { return std::make_shared<const std::string>(text); }

TEST(StreamFile, ReturnsWhatWasWrittenInOrder) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "stream").string();
  auto writer = StreamFileWriter::create(path);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(EncodedTopology{2, 1, 3, 4, bytes(std::string(300'000, 't'))}));
  ASSERT_TRUE(writer->write(EncodedFrame{7, 0.25, 2, 1.5, 0.5, bytes("frame")}));
  ASSERT_TRUE(writer->write(WorldEvent{.sequence = 3, .kind = EventKind::dent, .message = "dented"}));
  ASSERT_TRUE(writer->write(EventGap{4, 6}));
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(writer->bytes(), std::filesystem::file_size(path));

  auto reader = StreamFileReader::open(path);
  ASSERT_TRUE(reader);
  const auto topology = std::get<EncodedTopology>(**reader->next());
  EXPECT_EQ(topology.epoch, 2u);
  EXPECT_EQ(topology.base, 1u);
  EXPECT_EQ(topology.part, 3u);
  EXPECT_EQ(topology.parts, 4u);
  EXPECT_EQ(*topology.payload, std::string(300'000, 't'));
  const auto frame = std::get<EncodedFrame>(**reader->next());
  EXPECT_EQ(frame.step, 7u);
  EXPECT_EQ(frame.time, 0.25);
  EXPECT_EQ(*frame.payload, "frame");
  EXPECT_EQ(std::get<WorldEvent>(**reader->next()).message, "dented");
  EXPECT_EQ(std::get<EventGap>(**reader->next()).last, 6u);
  const auto end = reader->next();
  ASSERT_TRUE(end);
  EXPECT_FALSE(*end);
}

TEST(StreamFile, BadFilesAreErrors) {
  const test::TemporaryFolder folder;
  const auto first = [&](const std::string& content) {
    return StreamFileReader::open(folder.write("bad", content).string())->next();
  };
  EXPECT_FALSE(first("\x20 cut short"));
  EXPECT_FALSE(first(std::string(12, '\xff')));                  // a length without end
  EXPECT_FALSE(first("\xff\xff\xff\x7f" "x"));                   // claims 256 MiB
  EXPECT_FALSE(first(std::string("\x03\xff\xff\xff", 4)));       // no message
  EXPECT_EQ(StreamFileReader::open((folder.path() / "none").string()).error().code, ErrorCode::not_found);
  EXPECT_FALSE(StreamFileWriter::create((folder.path() / "no" / "such").string()));
}

}  // namespace
}  // namespace crumple::client
