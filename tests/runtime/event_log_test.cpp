#include "server/runtime/event_log.h"

#include <gtest/gtest.h>

namespace crumple::runtime {
namespace {

EventLog log_of(std::uint64_t count, std::size_t capacity) {
  EventLog log(capacity);
  for (std::uint64_t i = 1; i <= count; ++i) log.append({.sequence = i});
  return log;
}

TEST(EventLog, GivesEveryEventOnceInOrder) {
  const EventLog log = log_of(5, 10);
  for (std::uint64_t after = 0; after < 5; ++after) {
    const auto next = log.next(after);
    ASSERT_TRUE(std::holds_alternative<SharedEvent>(next));
    EXPECT_EQ(std::get<SharedEvent>(next)->sequence, after + 1);
  }
  EXPECT_TRUE(std::holds_alternative<std::monostate>(log.next(5)));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(log.next(99)));  // of a client that claims more than there is
}

TEST(EventLog, NamesTheGapOfWhatItNoLongerHolds) {
  const EventLog log = log_of(25, 10);
  const auto gap = log.next(3);
  ASSERT_TRUE(std::holds_alternative<EventGap>(gap));
  EXPECT_EQ(std::get<EventGap>(gap).first, 4u);
  EXPECT_EQ(std::get<EventGap>(gap).last, 15u);
  const auto next = log.next(15);
  ASSERT_TRUE(std::holds_alternative<SharedEvent>(next));
  EXPECT_EQ(std::get<SharedEvent>(next)->sequence, 16u);
}

TEST(EventLog, KeepsFewerOfThoseWithMuchDustButTheNewestInAnyCase) {
  EventLog log(10, 100);
  for (std::uint64_t i = 1; i <= 5; ++i) log.append({.sequence = i, .particles = std::vector<DustParticle>(40)});
  EXPECT_EQ(std::get<EventGap>(log.next(0)).last, 3u);  // two of 40 are left
  EXPECT_EQ(std::get<SharedEvent>(log.next(3))->sequence, 4u);
  log.append({.sequence = 6, .particles = std::vector<DustParticle>(400)});
  EXPECT_EQ(std::get<EventGap>(log.next(3)).last, 5u);
  EXPECT_EQ(std::get<SharedEvent>(log.next(5))->sequence, 6u);
}

TEST(EventLog, IsEmptyAtFirst) {
  EXPECT_EQ(EventLog(4).last(), 0u);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(EventLog(4).next(0)));
}

}  // namespace
}  // namespace crumple::runtime
