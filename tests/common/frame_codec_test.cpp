#include "common/stream_decoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace crumple {
namespace {

std::vector<Vec3f> random_vertices(int count, std::mt19937& random) {
  std::uniform_real_distribution<float> x(-3, 5), y(0.1f, 0.4f), z(100, 101);
  std::vector<Vec3f> vertices(count);
  for (Vec3f& v : vertices) v = Vec3f(x(random), y(random), z(random));
  return vertices;
}

Frame some_frame(int vertices = 37) {
  std::mt19937 random(1);
  Frame frame{.step = 1ull << 40, .time = 12.34, .epoch = 7, .step_ms = 3.25, .real_time_factor = 0.5, .bodies = {}};
  BodyFrame rigid{.id = 0, .pose = {Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), Vec3(1, -2, 3)}, .positions = {}, .values = {}};
  BodyFrame soft{.id = 3, .pose = {}, .positions = random_vertices(vertices, random), .values = {}};
  for (int v = 0; v < vertices; ++v) soft.values.push_back(static_cast<float>(v) / static_cast<float>(vertices));
  frame.bodies = {rigid, soft};
  return frame;
}

// Body 3 is the one that moves in some_frame(vertices).
Topology some_topology(int vertices = 37) {
  std::mt19937 random(2);
  Topology topology{.epoch = 7, .bodies = {}};
  topology.bodies.resize(4);
  for (BodyId id = 0; id < 4; ++id) topology.bodies[id].id = id;
  BodyTopology& pane = topology.bodies[1];
  pane.name = "pane";
  pane.epoch = 6;
  pane.model = BodyModel::fem;
  pane.deformable = true;
  pane.vertices = random_vertices(11, random);
  pane.triangles = {{0, 1, 2}, {10, 9, 8}, {3, 4, 5}};
  pane.colour = {0.25f, 0.5f, 1};
  pane.opacity = 0.4f;
  pane.channels = {"front", "", "rear bumper"};
  BodyTopology& soft = topology.bodies[3];
  soft.deformable = true;
  soft.vertices = random_vertices(vertices, random);
  for (int v = 2; v < vertices; ++v) soft.triangles.push_back({v - 2, v - 1, v});
  return topology;
}

std::string one_message(const Topology& topology, Codec codec, bool compress) {
  std::vector<std::string> messages = encode(topology, std::nullopt, codec, compress);
  EXPECT_EQ(messages.size(), 1u);
  return messages.front();
}

// Through the wire to a reader who has the topology.
Result<Frame> sent(const Frame& frame, const Topology& topology, Codec codec, bool compress) {
  StreamDecoder reader;
  EXPECT_TRUE(reader.take_topology(one_message(topology, codec, compress)));
  return reader.decode_frame(encode(frame, FrameReference::of_sender(topology), codec, compress));
}

Result<Topology> sent(const Topology& topology, Codec codec, bool compress) {
  StreamDecoder reader;
  if (auto taken = reader.take_topology(one_message(topology, codec, compress)); !taken) return std::unexpected(taken.error());
  return reader.topology();
}

void expect_equal(const Topology& a, const Topology& b) {
  EXPECT_EQ(a.epoch, b.epoch);
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].id, b.bodies[i].id);
    EXPECT_EQ(a.bodies[i].epoch, b.bodies[i].epoch);
    EXPECT_EQ(a.bodies[i].name, b.bodies[i].name);
    EXPECT_EQ(a.bodies[i].model, b.bodies[i].model);
    EXPECT_EQ(a.bodies[i].deformable, b.bodies[i].deformable);
    EXPECT_EQ(a.bodies[i].triangles, b.bodies[i].triangles);
    EXPECT_EQ(a.bodies[i].colour, b.bodies[i].colour);
    EXPECT_EQ(a.bodies[i].opacity, b.bodies[i].opacity);
    EXPECT_EQ(a.bodies[i].channels, b.bodies[i].channels);
    EXPECT_EQ(a.bodies[i].vertices.size(), b.bodies[i].vertices.size());
  }
}

TEST(FrameCodec, FloatFramesComeBackExactly) {
  const Frame frame = some_frame();
  for (const bool compress : {false, true}) {
    const auto back = sent(frame, some_topology(), Codec::float32, compress);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_EQ(back->step, frame.step);
    EXPECT_EQ(back->time, frame.time);
    EXPECT_EQ(back->epoch, frame.epoch);
    EXPECT_EQ(back->step_ms, frame.step_ms);
    EXPECT_EQ(back->real_time_factor, frame.real_time_factor);
    ASSERT_EQ(back->bodies.size(), 2u);
    EXPECT_TRUE(back->bodies[0].pose.R_WB.coeffs().isApprox(frame.bodies[0].pose.R_WB.coeffs(), 1e-7));  // float
    EXPECT_EQ(back->bodies[0].pose.p_WB, frame.bodies[0].pose.p_WB);
    EXPECT_EQ(back->bodies[1].id, 3u);
    EXPECT_EQ(back->bodies[1].positions, frame.bodies[1].positions);
    EXPECT_EQ(back->bodies[1].values, frame.bodies[1].values);
  }
}

TEST(FrameCodec, TopologiesComeBack) {
  const Topology topology = some_topology();
  for (const bool compress : {false, true}) {
    const auto exact = sent(topology, Codec::float32, compress);
    ASSERT_TRUE(exact) << exact.error().text();
    expect_equal(*exact, topology);
    EXPECT_EQ(exact->bodies[1].vertices, topology.bodies[1].vertices);
    const auto near = sent(topology, Codec::quantised16, compress);
    ASSERT_TRUE(near) << near.error().text();
    expect_equal(*near, topology);
  }
}

TEST(FrameCodec, QuantisationErrsByHalfAStepOfTheBox) {
  const Frame frame = some_frame(5000);
  const auto back = sent(frame, some_topology(5000), Codec::quantised16, true);
  ASSERT_TRUE(back) << back.error().text();
  const auto &before = frame.bodies[1].positions, &after = back->bodies[1].positions;
  Vec3f low = before[0], high = before[0];
  for (const Vec3f& p : before) low = low.cwiseMin(p), high = high.cwiseMax(p);
  float worst = 0;
  for (std::size_t v = 0; v < before.size(); ++v)
    for (int a = 0; a < 3; ++a) {
      const float error = std::abs(after[v][a] - before[v][a]);
      const float ulp = std::abs(before[v][a]) * 0x1p-23f;  // a float near 100 m is itself 8e-6 m coarse
      EXPECT_LE(error, (high - low)[a] / 131070 + ulp);
      if (a == 0) worst = std::max(worst, error);
    }
  EXPECT_GT(worst, (high - low)[0] / 262140);  // it is quantised
  for (std::size_t v = 0; v < before.size(); ++v)
    EXPECT_NEAR(back->bodies[1].values[v], frame.bodies[1].values[v], 1 / 509.0);
}

TEST(FrameCodec, AFlatOrSinglePointBodyComesBackExactly) {
  Frame frame = some_frame(0);
  frame.bodies[1].positions = {Vec3f(1, 2, 3), Vec3f(1, 5, 3), Vec3f(1, 2, 3)};
  for (const bool compress : {false, true}) {
    const auto back = sent(frame, some_topology(3), Codec::quantised16, compress);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->bodies[1].positions, frame.bodies[1].positions);
  }
}

TEST(FrameCodec, TheBytesAreThoseOfTheTable) {
  Frame frame{.step = 0x0102030405060708, .time = 1.5, .epoch = 5, .step_ms = 0, .real_time_factor = 0, .bodies = {}};
  frame.bodies.push_back({.id = 9, .pose = {Quat(1, 0, 0, 0), Vec3(0, 0, 2)}, .positions = {Vec3f(0, 0, 0), Vec3f(1, 2, 4)}, .values = {1, 0}});
  Topology topology{.epoch = 5, .bodies = {}};
  topology.bodies.resize(10);
  topology.bodies[9].deformable = true;
  topology.bodies[9].vertices.resize(2);
  const std::string bytes = encode(frame, FrameReference::of_sender(topology), Codec::quantised16, false);
  const auto byte = [&](int at) { return static_cast<int>(static_cast<unsigned char>(bytes[at])); };
  const auto number = [&](int at) { float f; std::memcpy(&f, bytes.data() + at, 4); return f; };
  EXPECT_EQ(bytes.substr(0, 4), "CRFC");
  EXPECT_EQ(byte(4), 2);
  EXPECT_EQ(byte(5), 2);
  EXPECT_EQ(byte(6), 0);
  EXPECT_EQ(byte(7), 0);
  EXPECT_EQ(byte(8), 40 + 40 + 24 + 12 + 4);  // frame, body, box, 6 u16, 2 u8 padded
  EXPECT_EQ(bytes.size(), 16u + byte(8));
  EXPECT_EQ(byte(16), 8);                     // lowest byte of step first
  EXPECT_EQ(byte(16 + 32), 5);                // epoch
  EXPECT_EQ(byte(16 + 36), 1);                // bodies
  constexpr int body = 16 + 40;
  EXPECT_EQ(byte(body), 9);
  EXPECT_EQ(byte(body + 4), 2);
  EXPECT_EQ(byte(body + 8), 2);
  EXPECT_EQ(number(body + 24), 1.0f);         // w of x y z w
  EXPECT_EQ(number(body + 36), 2.0f);         // z of p_WB
  EXPECT_EQ(number(body + 40 + 12 + 8), 4.0f);  // z size of the box
  EXPECT_EQ(byte(body + 64 + 0), 0);
  EXPECT_EQ(byte(body + 64 + 6), 255);        // second vertex: 65535 in x
  EXPECT_EQ(byte(body + 64 + 7), 255);
  EXPECT_EQ(byte(body + 76), 255);            // value 1
  EXPECT_EQ(byte(body + 77), 0);
}

TEST(FrameCodec, NumbersThatAreNotFiniteAreWrittenAsZero) {
  Frame frame = some_frame(3);
  frame.bodies[1].positions[1] = Vec3f(std::numeric_limits<float>::quiet_NaN(), INFINITY, 3e38f);
  frame.bodies[1].values[0] = -INFINITY;
  frame.time = NAN;
  for (const Codec codec : {Codec::float32, Codec::quantised16}) {
    const auto back = sent(frame, some_topology(3), codec, true);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_LT(back->bodies[1].positions[1].norm(), 101.0f / 65535 * 2);
    EXPECT_EQ(back->bodies[1].values[0], 0);
    EXPECT_EQ(back->time, 0);
  }
}

TEST(FrameCodec, CompressionHalvesASmoothFrame) {
  Frame frame = some_frame(0);
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 60; ++j) frame.bodies[1].positions.push_back(Vec3f(0.1f * i, 0, 0.1f * j));
  Topology topology = some_topology(3600);
  topology.bodies[3].vertices = frame.bodies[1].positions;
  for (Vec3f& X : topology.bodies[3].vertices) X.y() = std::sin(X.x());  // it has been bent since
  const FrameReference reference = FrameReference::of_sender(topology);
  EXPECT_LT(2 * encode(frame, reference, Codec::quantised16, true).size(), encode(frame, reference, Codec::quantised16, false).size());
}

std::vector<std::string> valid_messages() {
  std::vector<std::string> messages;
  for (const Codec codec : {Codec::float32, Codec::quantised16})
    for (const bool compress : {false, true}) {
      messages.push_back(encode(some_frame(9), FrameReference::of_sender(some_topology(9)), codec, compress));
      messages.push_back(one_message(some_topology(9), codec, compress));
    }
  return messages;
}

bool accepted(std::string_view bytes) {
  static const FrameReference reference = FrameReference::of_receiver(some_topology(9));
  return decode_frame(bytes, reference).has_value() || decode_topology_part(bytes).has_value();
}

TEST(FrameCodec, EveryTruncationIsAnError) {
  for (const std::string& message : valid_messages()) {
    ASSERT_TRUE(accepted(message));
    for (std::size_t length = 0; length < message.size(); ++length) {
      const std::string cut(message.data(), length);  // own storage: a sanitizer sees a read past its end
      EXPECT_FALSE(accepted(cut)) << length;
    }
    EXPECT_FALSE(accepted(message + '\0'));
  }
}

TEST(FrameCodec, AShortContentUnderAnHonestHeaderIsAnError) {
  for (const Codec codec : {Codec::float32, Codec::quantised16})
    for (const bool topology : {false, true}) {
      const std::string whole = topology ? one_message(some_topology(9), codec, false)
                                         : encode(some_frame(9), FrameReference::of_sender(some_topology(9)), codec, false);
      for (std::uint32_t length = 0; length + 16 < whole.size(); ++length) {
        std::string cut = whole.substr(0, 16 + length);
        std::memcpy(cut.data() + 8, &length, 4);
        EXPECT_FALSE(accepted(cut)) << length;
      }
    }
}

TEST(FrameCodec, RandomByteFlipsNeverCrash) {
  std::mt19937 random(3);
  const auto messages = valid_messages();
  int errors = 0;
  for (int round = 0; round < 40000; ++round) {
    std::string message = messages[round % messages.size()];
    for (int flips = 1 + static_cast<int>(random() % 4); flips > 0; --flips)
      message[random() % message.size()] = static_cast<char>(random());
    errors += !accepted(message);
  }
  EXPECT_GT(errors, 1000);
}

TEST(FrameCodec, AWrongHeaderIsNamed) {
  const FrameReference reference = FrameReference::of_sender(some_topology());
  const std::string good = encode(some_frame(), reference, Codec::quantised16, true);
  const auto error = [&](int at, char value) {
    std::string bad = good;
    bad[at] = value;
    const auto result = decode_frame(bad, reference);
    return result ? std::string("accepted") : result.error().text();
  };
  EXPECT_EQ(error(0, 'X'), "message does not begin with CRFC");
  EXPECT_EQ(error(4, 3), "version is 3, must be 1 or 2");
  EXPECT_EQ(error(5, 1), "kind is 1, must be 2");
  EXPECT_EQ(error(6, 7), "codec is 7, must be 0 or 1");
  EXPECT_EQ(error(7, 2), "compressed is 2, must be 0 or 1");
  EXPECT_EQ(error(11, 0x7f).substr(0, 9), "length is");
  EXPECT_EQ(error(12, 1), "reserved is 1, must be 0");
  EXPECT_EQ(error(16, 0), "content is not one whole zstd frame");
}

TEST(FrameCodec, AbsurdCountsAreErrorsAndTakeNoMemory) {
  const FrameReference reference = FrameReference::of_sender(some_topology(9));
  const std::string good = encode(some_frame(9), reference, Codec::float32, false);
  for (const int at : {16 + 36, 16 + 40 + 4, 16 + 40 + 8}) {
    std::string bad = good;
    const std::uint32_t absurd = 0xffffffff;
    std::memcpy(bad.data() + at, &absurd, 4);
    EXPECT_FALSE(decode_frame(bad, reference));
  }
  std::string claim = encode(some_frame(9), reference, Codec::float32, true);
  const std::uint32_t length = kMaxContentBytes;
  std::memcpy(claim.data() + 8, &length, 4);
  EXPECT_NE(decode_frame(claim, reference).error().text().find("too many"), std::string::npos);
}

TEST(FrameCodec, ATriangleThatNamesNoVertexIsAnError) {
  for (const bool compress : {false, true}) {
    Topology topology = some_topology();
    topology.bodies[1].triangles[1][2] = 11;
    EXPECT_FALSE(sent(topology, Codec::float32, compress));
  }
}

TEST(FrameCodec, PositionsOfAnotherTopologyAreAnError) {
  const Topology topology = some_topology(9);
  const std::string frame = encode(some_frame(9), FrameReference::of_sender(topology), Codec::quantised16, true);
  EXPECT_TRUE(decode_frame(frame, FrameReference::of_receiver(topology)));
  EXPECT_FALSE(decode_frame(frame, FrameReference::of_receiver(some_topology(10))));  // another number of vertices
  Topology later = topology;
  later.epoch = 8;
  EXPECT_EQ(decode_frame(frame, FrameReference::of_receiver(later)).error().text(), "epoch is 7, must be 8, that of the topology");
  later = topology;
  later.bodies.pop_back();
  EXPECT_FALSE(decode_frame(frame, FrameReference::of_receiver(later)));  // no such body
}

// Shards of `each` vertices, a small ball of them around each place of a lattice.
Topology shards(int count, int each) {
  std::mt19937 random(4);
  std::normal_distribution<float> offset(0, 0.02f);
  Topology topology{.epoch = 0, .bodies = {{.id = 0, .deformable = true}}};
  BodyTopology& body = topology.bodies[0];
  for (int s = 0; s < count; ++s) {
    const int first = static_cast<int>(body.vertices.size());
    for (int v = 0; v < each; ++v)
      body.vertices.push_back(Vec3f(0.1f * static_cast<float>(s % 10), 0.1f * static_cast<float>(s / 10), 0) +
                              Vec3f(offset(random), offset(random), offset(random)));
    for (int v = 2; v < each; ++v) body.triangles.push_back({first, first + v - 1, first + v});
  }
  return topology;
}

TEST(FrameCodec, ShardsThatOnlyMovedCostTheirMotionsAndAByteAVertex) {
  constexpr int kShards = 80, kEach = 30;
  const Topology topology = shards(kShards, kEach);
  std::mt19937 random(5);
  std::normal_distribution<double> any;
  Frame frame{.epoch = 0, .bodies = {{.id = 0}}};
  for (int s = 0; s < kShards; ++s) {
    const Quat R = Quat(any(random), any(random), any(random), any(random)).normalized();
    const Vec3 t(any(random), any(random), any(random));
    for (int v = 0; v < kEach; ++v) frame.bodies[0].positions.push_back((R * topology.bodies[0].vertices[kEach * s + v].cast<double>() + t).cast<float>());
  }
  const std::string bytes = encode(frame, FrameReference::of_sender(topology), Codec::quantised16, true);
  EXPECT_LT(bytes.size(), std::size_t{200 + 28 * kShards + kShards * kEach});  // 6 bytes a vertex, and nothing to compress, without
  const auto back = sent(frame, topology, Codec::quantised16, true);
  ASSERT_TRUE(back) << back.error().text();
  const auto plain = sent(frame, topology, Codec::quantised16, false);
  EXPECT_EQ(back->bodies[0].positions, plain->bodies[0].positions);  // how they are told changes nothing in what is told
}

TEST(FrameCodec, TrianglesThatNameVerticesInOrderTakeAFewBytes) {
  Topology topology{.epoch = 0, .bodies = {{.id = 0, .deformable = true}}};
  BodyTopology& body = topology.bodies[0];
  constexpr int kSide = 60;
  std::vector<int> id(kSide * kSide, -1);
  const auto vertex = [&](int i, int j) {
    int& v = id[kSide * i + j];
    if (v < 0) {
      v = static_cast<int>(body.vertices.size());
      body.vertices.emplace_back(static_cast<float>(i), 0, static_cast<float>(j));
    }
    return v;
  };
  for (int i = 0; i + 1 < kSide; ++i) {
    for (int j = 0; j + 1 < kSide; ++j) {
      body.triangles.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
      body.triangles.push_back({vertex(i + 1, j), vertex(i, j + 1), vertex(i + 1, j + 1)});
    }
  }
  Topology no_triangles = topology;
  no_triangles.bodies[0].triangles.clear();
  const std::size_t bytes = one_message(topology, Codec::quantised16, true).size() - one_message(no_triangles, Codec::quantised16, true).size();
  EXPECT_LT(bytes, 2 * body.triangles.size());  // of 12
  EXPECT_EQ(sent(topology, Codec::quantised16, true)->bodies[0].triangles, body.triangles);
}

TEST(FrameCodec, WhatIsTooLongForAMessageIsNamed) {
  const Topology topology = some_topology(100);
  EXPECT_FALSE(too_long(topology));
  EXPECT_NE(too_long(topology, 2000)->find("body 3"), std::string::npos);  // 100 vertices and 98 triangles of 12 bytes
  Topology many{.epoch = 0, .bodies = {}};
  for (BodyId id = 0; id < 20; ++id) many.bodies.push_back({.id = id, .deformable = true, .vertices = std::vector<Vec3f>(100, Vec3f(1, 2, 3))});
  EXPECT_NE(too_long(many, 20'000)->find("a frame"), std::string::npos);  // 20 times 100 of 12 bytes
  EXPECT_FALSE(too_long(many, 40'000));
  for (BodyTopology& body : many.bodies) body.channels = {"front", "rear", "roof"};  // a number each
  EXPECT_TRUE(too_long(many, 40'000));
  EXPECT_FALSE(too_long(many, 60'000));
}

}  // namespace
}  // namespace crumple
