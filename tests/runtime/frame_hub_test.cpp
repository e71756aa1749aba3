#include "server/runtime/frame_hub.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/runtime/awaited.h"
#include "tests/runtime/fake_clock.h"

namespace crumple::runtime {
namespace {

using test::BellReader;

// Two bodies; the second is as it is since `epoch`.
std::shared_ptr<const PublishedTopology> topology(std::uint32_t epoch, std::size_t max_content = kMaxContentBytes) {
  Topology topology{epoch, {BodyTopology{.id = 0, .name = "floor"}, BodyTopology{.id = 1, .epoch = epoch, .name = "body"}}};
  return std::make_shared<PublishedTopology>(std::move(topology), nullptr, max_content);
}

std::shared_ptr<const PublishedFrame> frame(std::uint64_t step, const std::shared_ptr<const PublishedTopology>& topology,
                                            bool values = false) {
  Frame frame{.step = step, .epoch = topology->topology().epoch};
  frame.bodies.push_back({.values = std::vector<float>(values ? 3 : 0, 0.5f)});
  return std::make_shared<PublishedFrame>(std::move(frame), values, topology);
}

std::vector<sim::Event> events(std::uint64_t first, std::uint64_t last) {
  std::vector<sim::Event> list;
  for (std::uint64_t i = first; i <= last; ++i) list.push_back({.sequence = i});
  return list;
}

// One word a delivery: "topology 2", "topology 3 since 2", "part 2 of 3", "frame 7", "event 3", "gap 1-5", "closed", "nothing".
std::string word(const std::optional<Delivery>& delivery) {
  if (!delivery) return "nothing";
  if (const auto* gap = std::get_if<EventGap>(&*delivery))
    return "gap " + std::to_string(gap->first) + "-" + std::to_string(gap->last);
  if (const auto* event = std::get_if<SharedEvent>(&*delivery)) return "event " + std::to_string((*event)->sequence);
  if (const auto* top = std::get_if<TopologyDelivery>(&*delivery)) {
    if (top->part > 0) return "part " + std::to_string(top->part + 1) + " of " + std::to_string(top->parts);
    return "topology " + std::to_string(top->epoch) + (top->base ? " since " + std::to_string(*top->base) : "");
  }
  if (const auto* next = std::get_if<FrameDelivery>(&*delivery))
    return "frame " + std::to_string(next->frame->frame().step);
  return "closed";
}

std::string drain(FrameReader& reader) {
  std::string all;
  for (std::string next = word(reader.poll()); next != "nothing"; next = word(reader.poll())) all += next + ", ";
  return all;
}

TEST(FrameHub, SlowReaderSkipsToNewest) {
  FrameHub hub;
  const auto reader = hub.subscribe({.credits = 1}, [] {});
  const auto first = topology(0);
  hub.publish(frame(1, first));
  EXPECT_EQ(drain(*reader), "topology 0, frame 1, ");
  for (std::uint64_t step = 2; step <= 50; ++step) hub.publish(frame(step, first));
  EXPECT_EQ(drain(*reader), "");  // no credit
  reader->grant(1);
  EXPECT_EQ(drain(*reader), "frame 50, ");
  reader->grant(5);
  EXPECT_EQ(drain(*reader), "");  // the same frame is not sent twice
  hub.publish(frame(51, first));
  EXPECT_EQ(drain(*reader), "frame 51, ");
}

TEST(FrameHub, SlowReaderLosesNoEvent) {
  FrameHub hub;
  const auto reader = hub.subscribe({.credits = 1}, [] {});
  const auto first = topology(0);
  for (std::uint64_t step = 1; step <= 100; ++step) {
    hub.append(events(3 * step - 2, 3 * step));
    hub.publish(frame(step, first));
  }
  for (std::uint64_t i = 1; i <= 300; ++i) ASSERT_EQ(word(reader->poll()), "event " + std::to_string(i));
  EXPECT_EQ(drain(*reader), "topology 0, frame 100, ");  // after the events of their steps
}

TEST(FrameHub, ReaderThatFallsOffTheLogIsToldAndGetsAllBodies) {
  FrameHub hub(steady_wall_clock(), 4);
  const auto reader = hub.subscribe({.credits = 2}, [] {});
  const auto first = topology(0);
  hub.publish(frame(1, first));
  EXPECT_EQ(drain(*reader), "topology 0, frame 1, ");
  hub.append(events(1, 10));
  EXPECT_EQ(drain(*reader), "gap 1-6, event 7, event 8, event 9, event 10, topology 0, frame 1, ");
}

TEST(FrameHub, TopologyComesOnceBeforeTheFramesOfItsEpoch) {
  FrameHub hub;
  const auto reader = hub.subscribe({.credits = 10}, [] {});
  const auto first = topology(0), second = topology(1);
  hub.publish(frame(1, first));
  EXPECT_EQ(drain(*reader), "topology 0, frame 1, ");
  hub.publish(frame(2, first));
  EXPECT_EQ(drain(*reader), "frame 2, ");
  hub.publish(frame(3, second));
  EXPECT_EQ(drain(*reader), "topology 1 since 0, frame 3, ");
}

TEST(FrameHub, AReaderThatSkipsEpochsGetsTheirChangesOnceAndOneThatIsNewGetsAllBodies) {
  FrameHub hub;
  const auto slow = hub.subscribe({.credits = 1}, [] {});
  hub.publish(frame(1, topology(0)));
  EXPECT_EQ(drain(*slow), "topology 0, frame 1, ");
  for (std::uint32_t epoch = 1; epoch <= 5; ++epoch) hub.publish(frame(1 + epoch, topology(epoch)));
  slow->grant(1);
  const auto changes = slow->poll();
  EXPECT_EQ(word(changes), "topology 5 since 0");
  const auto part = decode_topology_part(*std::get<TopologyDelivery>(*changes).payload);
  ASSERT_EQ(part->bodies.size(), 1u);
  EXPECT_EQ(part->bodies[0].name, "body");
  EXPECT_EQ(drain(*slow), "frame 6, ");
  const auto late = hub.subscribe({.credits = 1}, [] {});
  const auto all = late->poll();
  EXPECT_EQ(word(all), "topology 5");
  EXPECT_EQ(decode_topology_part(*std::get<TopologyDelivery>(*all).payload)->bodies.size(), 2u);
}

TEST(FrameHub, ATopologyThatIsTooLongComesInPartsBeforeItsFrame) {
  FrameHub hub(steady_wall_clock(), 4);
  const auto reader = hub.subscribe({.credits = 3}, [] {});
  hub.publish(frame(1, topology(0, /*max_content=*/200)));
  EXPECT_EQ(word(reader->poll()), "topology 0");
  hub.append(events(1, 1));
  hub.publish(frame(2, topology(1, 200)));
  EXPECT_EQ(drain(*reader), "event 1, part 2 of 2, frame 1, topology 1 since 0, frame 2, ");
  hub.publish(frame(3, topology(2, 200)));
  EXPECT_EQ(word(reader->poll()), "topology 2 since 1");
  hub.append(events(2, 9));  // falls off the log before the frame
  EXPECT_EQ(drain(*reader), "gap 2-5, event 6, event 7, event 8, event 9, topology 2, part 2 of 2, frame 3, ");
}

TEST(FrameHub, AWorldThatBreaksAtEveryStepStillSendsFrames) {
  FrameHub hub;
  const auto reader = hub.subscribe({.credits = 1}, [] {});
  hub.publish(frame(1, topology(1)));
  EXPECT_EQ(word(reader->poll()), "topology 1");
  hub.publish(frame(2, topology(2)));  // between topology and frame
  EXPECT_EQ(word(reader->poll()), "frame 1");
}

TEST(FrameHub, ReadersOfOneFormatShareOneEncoding) {
  FrameHub hub;
  const auto a = hub.subscribe({.credits = 1}, [] {});
  const auto b = hub.subscribe({.credits = 1}, [] {});
  const auto other = hub.subscribe({.format = {Codec::float32, false, false}, .credits = 1}, [] {});
  hub.publish(frame(1, topology(0)));
  const auto payload = [](FrameReader& reader) {
    const auto top = std::get<TopologyDelivery>(*reader.poll()).payload;
    return std::pair(top, std::get<FrameDelivery>(*reader.poll()).payload);
  };
  const auto of_a = payload(*a), of_b = payload(*b), of_other = payload(*other);
  EXPECT_EQ(of_a, of_b);  // the same bytes in memory
  EXPECT_NE(of_a.second, of_other.second);
  EXPECT_EQ(decode_frame(*of_other.second, topology(0)->reference())->step, 1u);
}

TEST(FrameHub, ValuesGoOnlyToThoseWhoWantThem) {
  FrameHub hub;
  const auto plain = hub.subscribe({.credits = 1}, [] {});
  const auto values = hub.subscribe({.format = {.values = true}, .credits = 1}, [] {});
  EXPECT_TRUE(hub.demand(1).frame);
  EXPECT_TRUE(hub.demand(1).values);
  hub.publish(frame(1, topology(0), /*values=*/true));
  plain->poll();
  values->poll();
  const FrameReference reference = topology(0)->reference();
  EXPECT_TRUE(decode_frame(*std::get<FrameDelivery>(*plain->poll()).payload, reference)->bodies[0].values.empty());
  EXPECT_EQ(decode_frame(*std::get<FrameDelivery>(*values->poll()).payload, reference)->bodies[0].values.size(), 3u);
}

TEST(FrameHub, AFrameWithoutValuesDoesNotServeAReaderOfValues) {
  FrameHub hub;
  hub.publish(frame(1, topology(0)));
  const auto reader = hub.subscribe({.format = {.values = true}, .credits = 1}, [] {});
  EXPECT_EQ(drain(*reader), "");
  EXPECT_TRUE(hub.demand(1).values);  // the same step again, with values
  hub.publish(frame(1, topology(0), /*values=*/true));
  EXPECT_EQ(drain(*reader), "topology 0, frame 1, ");
}

TEST(FrameHub, AsksForFramesOnlyWhenAReaderWaits) {
  FrameHub hub;
  EXPECT_FALSE(hub.demand(1).frame);
  auto reader = hub.subscribe({}, [] {});
  EXPECT_FALSE(hub.demand(1).frame);  // no credit
  reader->grant(1);
  EXPECT_TRUE(hub.demand(1).frame);
  hub.publish(frame(1, topology(0)));
  EXPECT_FALSE(hub.demand(1).frame);  // there already
  EXPECT_TRUE(hub.demand(2).frame);
  reader.reset();
  EXPECT_FALSE(hub.demand(2).frame);
  EXPECT_EQ(hub.readers(), 0);
}

TEST(FrameHub, RateLimitHoldsFramesBackAndThenSendsTheNewest) {
  const auto clock = std::make_shared<test::FakeClock>();
  FrameHub hub(clock);
  const auto first = topology(0);
  hub.publish(frame(1, first));
  // No credit beyond the first: the hub's thread, which lets the fake time pass while it waits, has nothing to wait for.
  const auto reader = hub.subscribe({.max_rate_hz = 10, .credits = 1}, [] {});
  EXPECT_EQ(drain(*reader), "topology 0, frame 1, ");
  hub.publish(frame(2, first));
  hub.publish(frame(3, first));
  EXPECT_EQ(drain(*reader), "");
  const double before = clock->now();
  BellReader waiting(hub, {.max_rate_hz = 10, .credits = 2});
  EXPECT_EQ(word(waiting.next()), "topology 0");
  EXPECT_EQ(word(waiting.next()), "frame 3");
  hub.publish(frame(4, first));
  EXPECT_EQ(word(waiting.next()), "frame 4");
  EXPECT_GE(clock->now() - before, 0.1 - 1e-9);  // not before a tenth of a second of the clock has passed
}

TEST(FrameHub, CreditsAreBounded) {
  FrameHub hub;
  const auto reader = hub.subscribe({}, [] {});
  reader->grant(0xffffffff);
  reader->grant(0xffffffff);
  const auto first = topology(0);
  hub.publish(frame(0, first));
  reader->poll();
  std::uint32_t frames = 0;
  for (std::uint64_t step = 1; word(reader->poll()).starts_with("frame"); ++step, ++frames) hub.publish(frame(step, first));
  EXPECT_EQ(frames, FrameReader::kMaxCredits);
}

TEST(FrameHub, ClosingComesAfterTheLastEvents) {
  FrameHub hub;
  const auto reader = hub.subscribe({.credits = 1}, [] {});
  hub.append(events(1, 2));
  hub.close({ErrorCode::not_found, "", "gone"});
  hub.close({ErrorCode::internal, "", "later"});
  EXPECT_EQ(word(reader->poll()), "event 1");
  EXPECT_EQ(word(reader->poll()), "event 2");
  const auto closed = reader->poll();
  ASSERT_EQ(word(closed), "closed");
  EXPECT_EQ(std::get<Closed>(*closed).reason.message, "gone");
  EXPECT_EQ(word(reader->poll()), "nothing");
}

TEST(FrameHub, ReaderMayOutliveTheHub) {
  std::unique_ptr<FrameReader> reader;
  {
    FrameHub hub;
    reader = hub.subscribe({.credits = 1}, [] {});
  }
  EXPECT_EQ(word(reader->poll()), "closed");
  reader->grant(1);
}

TEST(FrameHub, NotifiesReadersOnOtherThreads) {
  FrameHub hub;
  BellReader reader(hub, {.credits = 1});
  std::jthread world([&] { hub.publish(frame(1, topology(0))); });
  EXPECT_EQ(word(reader.next()), "topology 0");
  EXPECT_EQ(word(reader.next()), "frame 1");
}

}  // namespace
}  // namespace crumple::runtime
