#include "server/runtime/wall_clock.h"

#include <chrono>

namespace crumple::runtime {
namespace {

class SteadyClock final : public WallClock {
 public:
  double now() override { return std::chrono::duration<double>(Clock::now() - epoch_).count(); }

  void wait_until(std::unique_lock<std::mutex>& lock, std::condition_variable& wake, double deadline) override {
    if (deadline == kForever) return wake.wait(lock);
    wake.wait_until(lock, epoch_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(deadline)));
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point epoch_ = Clock::now();
};

}  // namespace

std::shared_ptr<WallClock> steady_wall_clock() { return std::make_shared<SteadyClock>(); }

}  // namespace crumple::runtime
