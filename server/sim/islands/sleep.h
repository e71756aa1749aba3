#pragma once

#include "server/sim/state_hash.h"

#include <cstdint>
#include <span>
#include <vector>

// Which bodies are stepped [Parker & O'Brien 2009, section 4]. The paper's islands are parts of a mesh that each sleep for
// themselves; here bodies that touch form one island, which falls asleep and wakes as a whole: nothing that leans on a
// sleeper is left in the air when it wakes.
namespace crumple::sim::islands {

enum class Activity : std::uint8_t {
  live,
  asleep,     // not stepped, held where it is until something wakes it
  kinematic,  // wholly scripted, held or fixed: moved by nobody but its script
};

// Bodies by their index. What moves them, and what counts as rest, is the caller's.
class SleepingIslands {
 public:
  explicit SleepingIslands(std::vector<Activity> bodies = {}) : activity_(std::move(bodies)) {}
  void add_live() { activity_.push_back(Activity::live); }  // one more body, after all others

  Activity activity(int body) const { return activity_[body]; }
  bool any_asleep() const { return asleep_ > 0; }
  // Ends for good that a body is stepped, one that is asleep included.
  void set_kinematic(int body);
  // A body that sleeps from the start.
  void put_to_sleep(int body);

  // Two bodies touch in this step, or may as well; one of them may be kinematic. In any order, as often as one likes.
  void touch(int a, int b);
  // Ends a step. still: nonzero for bodies that have been at rest for long enough, kinematic ones do not count. Live bodies
  // that touched each other in one of the last `memory` + 1 steps are an island (a body that leans on another may lose the
  // contact for a step), and where all of an island are still it falls asleep. Returns who did, ascending.
  std::vector<int> settle(std::span<const char> still, int memory);
  // Only takes in what touched.
  void remember(int memory);

  // Wakes the island of a body. Returns who woke, ascending; nobody if it was not asleep.
  std::vector<int> wake(int body);
  // Wakes the islands that touched a body, which itself may be kinematic.
  std::vector<int> wake_neighbours(int body);

  // Whether two bodies' island would be the same, were both live: a contact that is remembered.
  bool touched(int a, int b) const;
  void hash(StateHash& hash) const;

 private:
  struct Contact {
    int a, b;     // a < b
    int age;      // steps since it was seen last; stands still while one of them sleeps
    bool operator<(const Contact& other) const { return a != other.a ? a < other.a : b < other.b; }
  };
  bool sleeps(int body) const { return activity_[body] == Activity::asleep; }

  std::vector<Activity> activity_;
  int asleep_ = 0;                  // bodies
  std::vector<Contact> contacts_;   // ascending
  std::vector<Contact> touches_;    // of this step
  std::vector<int> parent_;         // scratch of settle()
  std::vector<char> moves_;
};

}  // namespace crumple::sim::islands
