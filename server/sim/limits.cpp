#include "server/sim/limits.h"

#include <charconv>
#include <cmath>

namespace crumple::sim {
namespace {

// The side of the range that the value lies beyond.
std::string rule(double value, const Range& range) {
  if (std::isnan(value)) return "a number";
  if (std::isinf(value) && !std::isinf(range.high)) return "finite";
  if (value < range.low || (range.above && value <= range.low))
    return (range.above ? "above " : "at least ") + number_text(range.low);
  return (range.below ? "below " : "at most ") + number_text(range.high);
}

bool inside(double value, const Range& range) {
  return (range.above ? value > range.low : value >= range.low) &&
         (range.below ? value < range.high : value <= range.high);
}

}  // namespace

std::string number_text(double value) {
  char text[32];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  return {text, end.ptr};
}

void FirstBreach::require(bool holds, const std::string& field, const std::string& message) {
  if (ok() && !holds) result_ = invalid(field, message);
}

void FirstBreach::number(double value, const Range& range, const std::string& field) {
  if (!ok() || inside(value, range)) return;
  result_ = invalid(field, "is " + number_text(value) + ", must be " + rule(value, range));
}

void FirstBreach::count(std::size_t value, std::size_t low, std::size_t high, const std::string& field) {
  if (!ok() || (value >= low && value <= high)) return;
  result_ = invalid(field, "has " + std::to_string(value) + " entries, must have " +
                               (value < low ? "at least " + std::to_string(low) : "at most " + std::to_string(high)));
}

void FirstBreach::vector(const Vec3& v, double limit, const std::string& field) {
  if (!ok()) return;
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(v[i])) return require(false, field + kAxes[i], "is " + number_text(v[i]) + ", must be finite");
  const double length = v.stableNorm();
  require(length <= limit, field, "has length " + number_text(length) + ", must be at most " + number_text(limit));
}

void FirstBreach::pose(const Pose& pose, const std::string& field) {
  if (!ok()) return;
  vector(pose.p_WB, kMaxPosition, field + ".position");
  const double length = pose.R_WB.coeffs().stableNorm();
  require(std::abs(length - 1) <= 1e-6, field + ".quaternion",
          "has length " + number_text(length) + ", must have unit length");
}

void FirstBreach::take(const Result<void>& other) {
  if (ok()) result_ = other;
}

}  // namespace crumple::sim
