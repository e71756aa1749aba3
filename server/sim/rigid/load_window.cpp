#include "server/sim/rigid/load_window.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim {

LoadWindow::LoadWindow(double dt, double time) : time_(std::max(dt, time)) {
  const double steps = time_ / dt;
  bucket_ = static_cast<int>(std::ceil(steps / kSteps));
  span_ = steps / bucket_;
  // One more than the span where the newest entry is not full yet; rounding must not make another.
  kept_.resize(static_cast<std::size_t>(std::ceil(span_ - 1e-9)) + (bucket_ > 1 ? 1 : 0));
}

void LoadWindow::add(const JointLoad& step) {
  if (filled_ == bucket_) {
    newest_ = (newest_ + 1) % static_cast<int>(kept_.size());
    kept_[newest_] = {};
    filled_ = 0;
  }
  kept_[newest_].impulse += step.impulse;
  kept_[newest_].couple += step.couple;
  ++filled_;
}

// From the newest entry back; of the last as much as is left of the span.
Vec3 LoadWindow::mean(Vec3 JointLoad::*part) const {
  const int count = static_cast<int>(kept_.size());
  Vec3 sum = kept_[newest_].*part;
  double left = span_ - static_cast<double>(filled_) / bucket_;
  for (int k = 1; k < count && left > 0; ++k, left -= 1) sum += std::min(left, 1.0) * (kept_[(newest_ - k + count) % count].*part);
  return sum / time_;
}

}  // namespace crumple::sim
