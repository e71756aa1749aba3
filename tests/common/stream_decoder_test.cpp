#include "common/stream_decoder.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple {
namespace {

// A world as its readers see it: bodies of a few vertices, two of each one's triangles more after each break.
struct BreakingWorld {
  Topology topology{.epoch = 0, .bodies = {}};
  FrameReference reference;
  std::mt19937 random;

  BreakingWorld(int bodies, unsigned seed) : random(seed) {
    for (int b = 0; b < bodies; ++b) {
      topology.bodies.push_back({.id = static_cast<BodyId>(b), .name = "body " + std::to_string(b), .deformable = b > 0});
      grow(topology.bodies.back());
    }
    reference = FrameReference::of_sender(topology);
  }
  void grow(BodyTopology& body) {
    std::uniform_real_distribution<float> at(-1, 1);
    body.vertices.resize(body.vertices.size() + 10);
    for (Vec3f& X : body.vertices) X = Vec3f(at(random), at(random), at(random));  // it has moved, too
    std::shuffle(body.vertices.begin(), body.vertices.end(), random);
    body.triangles.clear();
    for (int v = 2; v < static_cast<int>(body.vertices.size()); ++v) body.triangles.push_back({v, v - 1, v - 2});
  }
  void break_some() {
    ++topology.epoch;
    for (BodyTopology& body : topology.bodies) {
      if (!body.deformable || random() % 3 != 0) continue;
      grow(body);
      body.epoch = topology.epoch;
    }
    reference = FrameReference::of_sender(topology, &reference);
  }
  Frame frame() {
    std::uniform_real_distribution<float> at(-1, 1);
    Frame frame{.step = topology.epoch, .epoch = topology.epoch};
    for (const BodyTopology& body : topology.bodies) {
      frame.bodies.push_back({.id = body.id});
      if (!body.deformable) continue;
      for (const Vec3f& X : body.vertices) frame.bodies.back().positions.push_back(X + Vec3f(at(random), at(random), at(random)));
    }
    return frame;
  }
};

void expect_same(const Topology& a, const Topology& b) {
  EXPECT_EQ(a.epoch, b.epoch);
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].epoch, b.bodies[i].epoch);
    EXPECT_EQ(a.bodies[i].name, b.bodies[i].name);
    EXPECT_EQ(a.bodies[i].vertices.size(), b.bodies[i].vertices.size());
    EXPECT_EQ(a.bodies[i].triangles, b.bodies[i].triangles);
  }
}

std::vector<std::string> changes(const BreakingWorld& world, std::optional<std::uint32_t> since, std::size_t max_content = kMaxContentBytes) {
  return encode(world.topology, since, Codec::quantised16, true, max_content);
}

// Any sequence of breaks and skips, in any format, in parts or whole: the reader's topology is the world's, and of frames it takes
// those of its own topology and no other.
TEST(StreamDecoder, FollowsAWorldThatBreaksThroughSkipsAndNeverMixesEpochs) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    BreakingWorld world(6, seed);
    const Codec codec = seed % 2 ? Codec::float32 : Codec::quantised16;
    const bool compress = seed / 2 % 2;
    const std::size_t max_content = seed / 4 % 2 ? 1200 : kMaxContentBytes;
    StreamDecoder reader;
    std::optional<std::uint32_t> has;
    int refused = 0;
    for (int round = 0; round < 30; ++round) {
      const int breaks = static_cast<int>(world.random() % 4);
      for (int k = 0; k < breaks; ++k) world.break_some();
      const std::string bytes = encode(world.frame(), world.reference, codec, compress);
      if (has != world.topology.epoch) {
        EXPECT_FALSE(reader.decode_frame(bytes)) << "of a topology that is to come";
        ++refused;
        const auto parts = encode(world.topology, has, codec, compress, max_content);
        for (std::size_t k = 0; k < parts.size(); ++k) {
          const auto whole = reader.take_topology(parts[k]);
          ASSERT_TRUE(whole) << whole.error().text();
          EXPECT_EQ(*whole, k + 1 == parts.size());
          EXPECT_EQ(reader.decode_frame(bytes).has_value(), *whole) << "of a topology of which a part is to come";
        }
        has = world.topology.epoch;
      }
      expect_same(reader.topology(), world.topology);
      const auto frame = reader.decode_frame(bytes);
      ASSERT_TRUE(frame) << frame.error().text();
    }
    EXPECT_GT(refused, 10);
  }
}

TEST(StreamDecoder, GetsTheBodiesThatChangedAndNoOther) {
  BreakingWorld world(6, 1);
  const auto ids = [&](std::optional<std::uint32_t> since) {
    std::vector<BodyId> bodies;
    const auto part = decode_topology_part(changes(world, since)[0]);
    for (const BodyTopology& body : part->bodies) bodies.push_back(body.id);
    return bodies;
  };
  world.topology.epoch = 3;
  world.topology.bodies[2].epoch = 1;
  world.topology.bodies[5].epoch = 2;
  world.topology.bodies[3].epoch = 3;
  EXPECT_EQ(ids({}), (std::vector<BodyId>{0, 1, 2, 3, 4, 5}));  // one that is new
  EXPECT_EQ(ids(2), (std::vector<BodyId>{3}));                  // one that follows
  EXPECT_EQ(ids(1), (std::vector<BodyId>{3, 5}));               // one that skips: the union
  EXPECT_EQ(ids(0), (std::vector<BodyId>{2, 3, 5}));            // in which each is once, however often it broke
}

TEST(StreamDecoder, ATopologyThatBuildsOnAnotherIsAnErrorAndSoAreItsFrames) {
  BreakingWorld world(4, 2);
  StreamDecoder reader;
  world.break_some();
  EXPECT_FALSE(reader.take_topology(changes(world, 0)[0]));  // nothing to build on
  ASSERT_TRUE(reader.take_topology(changes(world, {})[0]));
  world.break_some();
  world.break_some();
  const auto missed = reader.take_topology(changes(world, 2)[0]);
  ASSERT_FALSE(missed);
  EXPECT_EQ(missed.error().text(), "base is 2, must be 1, the epoch of the topology");
  EXPECT_FALSE(reader.decode_frame(encode(world.frame(), world.reference, Codec::quantised16, true)));
  ASSERT_TRUE(reader.take_topology(changes(world, {})[0]));  // all of them help
  EXPECT_TRUE(reader.decode_frame(encode(world.frame(), world.reference, Codec::quantised16, true)));
}

TEST(StreamDecoder, APartThatIsMissingIsAnError) {
  BreakingWorld world(6, 3);
  const auto parts = changes(world, {}, 1000);
  ASSERT_GE(parts.size(), 3u);
  StreamDecoder reader;
  EXPECT_FALSE(reader.take_topology(parts[1]));
  EXPECT_FALSE(*reader.take_topology(parts[0]));
  EXPECT_FALSE(reader.take_topology(parts[2]));
  for (const std::string& part : parts) ASSERT_TRUE(reader.take_topology(part));  // from the first again
  expect_same(reader.topology(), world.topology);
}

TEST(StreamDecoder, BodiesThatAreNotAllThereOrNewAreErrors) {
  BreakingWorld world(3, 4);
  Topology holes = world.topology;
  holes.bodies.erase(holes.bodies.begin() + 1);
  StreamDecoder reader;
  EXPECT_EQ(reader.take_topology(encode(holes, {}, Codec::float32, false)[0]).error().text(), "bodies[1].id is 2, must be 1");
  ASSERT_TRUE(reader.take_topology(changes(world, {})[0]));
  Topology more = world.topology;
  more.epoch = 1;
  more.bodies.push_back({.id = 3, .epoch = 1});
  EXPECT_EQ(reader.take_topology(encode(more, 0, Codec::float32, false)[0]).error().text(), "bodies[0].id is 3, must be below 3");
}

TEST(StreamDecoder, ABreakOfASmallBodyCostsNoMoreThanThatBody) {
  BreakingWorld world(2, 5);
  BodyTopology& large = world.topology.bodies[0];
  large.vertices.resize(100'000);
  for (Vec3f& X : large.vertices) X = Vec3f::Random();
  BodyTopology& small = world.topology.bodies[1];
  world.topology.epoch = small.epoch = 1;
  const std::size_t plain = 12 * (small.vertices.size() + small.triangles.size());
  for (const Codec codec : {Codec::quantised16, Codec::float32})
    for (const bool compress : {false, true})
      EXPECT_LT(encode(world.topology, 0, codec, compress)[0].size(), plain + 150);  // header, name, colour
}

std::string from_hex(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

// Written by the program of version 1, quantised and compressed: a floor, and a pane of 3 by 3 vertices at z = 1, then at 2 + x.
TEST(StreamDecoder, ReadsRecordingsOfVersion1) {
  StreamDecoder reader;
  ASSERT_TRUE(reader.take_topology(from_hex(
      "4352464301010001500100000000000028b52ffd605000d50400d2c6131dc025ad01fcffc0ff1f3cdc9688d600c5f207ee4301f83542082164cb144fae1c"
      "4872e7c64ddc6eed49b434b1b596c6b08e2c8440e1c69503eeceefb41157a9eac01a8619087e14899d1042bfe74520003b3332843c60e3250fd8f8496095"
      "6f6d999d0d2584784376a0321016a851400e5d1b3305de0dcc5110827186b9311de7b0659501663b17712b13540e37d5ce4ea7778f63a008")));
  const Topology& topology = reader.topology();
  EXPECT_EQ(topology.epoch, 3u);
  ASSERT_EQ(topology.bodies.size(), 2u);
  EXPECT_EQ(topology.bodies[0].name, "floor");
  EXPECT_EQ(topology.bodies[1].epoch, 3u);
  EXPECT_EQ(topology.bodies[1].triangles.size(), 8u);
  EXPECT_EQ(topology.bodies[1].triangles[7], (Triangle{4, 8, 7}));
  EXPECT_EQ(topology.bodies[1].vertices[8], Vec3f(1, 0.5f, 1));
  const auto frame = reader.decode_frame(from_hex(
      "4352464301020001c80000000000000028b52ffd20c8d50200c4020c00d03f00f8f03f03000000028001000000093f0000803e00000040403ffffe0200ff"
      "ff0000ff0000feff0013004749204a4e774caa0681733a71ab2b47c81728bba52e001db80c05239eca2e07c28bb095bca01d1cc002"));
  ASSERT_TRUE(frame) << frame.error().text();
  EXPECT_EQ(frame->step, 12u);
  for (int v = 0; v < 9; ++v) {
    const Vec3f x = topology.bodies[1].vertices[v] + Vec3f(0, 0, 1 + topology.bodies[1].vertices[v].x());
    EXPECT_LT((frame->bodies[1].positions[v] - x).norm(), 2e-5f) << v;  // a step of a box of 1 m
  }
}

}  // namespace
}  // namespace crumple
