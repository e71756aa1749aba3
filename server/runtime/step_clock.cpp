#include "server/runtime/step_clock.h"

#include <cmath>

namespace crumple::runtime {
namespace {
constexpr double kSmoothing = 1;  // [s]
}

void StepClock::play(double now, double speed) {
  playing_ = true;
  speed_ = speed;
  due_ = last_ = now;
  simulated_ = elapsed_ = dropped_ = 0;
}

void StepClock::pause() {
  playing_ = false;
  simulated_ = elapsed_ = 0;
}

void StepClock::stepped(double now) {
  due_ += dt_ / speed_;
  if (now - due_ > max_owed_) {
    dropped_ += now - due_ - max_owed_;
    due_ = now - max_owed_;
  }
  const double wall = now - last_;
  const double keep = std::exp(-wall / kSmoothing);
  simulated_ = keep * simulated_ + dt_;
  elapsed_ = keep * elapsed_ + wall;
  last_ = now;
}

double StepClock::real_time_factor() const { return elapsed_ > 0 ? simulated_ / elapsed_ : 0; }

}  // namespace crumple::runtime
