#pragma once

#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>

namespace crumple::runtime {

// Wall time as the runtime sees it, so that tests can bring their own. Thread-safe.
class WallClock {
 public:
  static constexpr double kForever = std::numeric_limits<double>::infinity();

  virtual ~WallClock() = default;
  virtual double now() = 0;  // monotonic [s]
  // Waits for `wake` until `deadline` at most; may return early.
  virtual void wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& wake, double deadline) = 0;
};

std::shared_ptr<WallClock> steady_wall_clock();

}  // namespace crumple::runtime
