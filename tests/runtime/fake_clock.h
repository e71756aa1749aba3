#pragma once

#include "server/runtime/wall_clock.h"

#include <algorithm>

namespace crumple::test {

// Wall time that passes only when somebody waits for it, and by `cost` each time it is asked for.
class FakeClock final : public runtime::WallClock {
 public:
  explicit FakeClock(double cost = 0) : cost_(cost) {}

  double now() override {
    const std::lock_guard lock(mutex_);
    return now_ += cost_;
  }

  void wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& wake, double deadline) override {
    if (deadline == kForever) return wake.wait(lock);
    advance_to(deadline);
  }

  void advance_to(double time) {
    const std::lock_guard lock(mutex_);
    now_ = std::max(now_, time);
  }

 private:
  std::mutex mutex_;
  double now_ = 0, cost_;
};

}  // namespace crumple::test
