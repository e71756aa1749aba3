#include "server/lab/stability/step_times.h"

#include <algorithm>
#include <ctime>

namespace crumple::lab::stability {

namespace {
constexpr double kShort = 1e-3;  // [s]
}

void StepTimes::add(std::vector<double> seconds) {
  if (seconds.size() < 2) return;
  const auto middle = seconds.begin() + static_cast<long>(seconds.size() / 2);
  std::ranges::nth_element(seconds, middle);
  const double median = *middle;
  worst_ = std::max(worst_, *std::ranges::max_element(seconds) / std::max(median, kShort));
}

double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace crumple::lab::stability
