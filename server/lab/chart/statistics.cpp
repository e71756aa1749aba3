#include "server/lab/chart/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace crumple::lab::chart {
namespace {

constexpr double kSaturated = 0.7;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Spread spread(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  if (values.empty()) return {kNaN, kNaN, kNaN, kNaN};
  std::sort(values.begin(), values.end());
  const auto at = [&](double q) {
    const double place = q * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    // Equal neighbours, infinite ones too, need no interpolation.
    if (values[below] == values[above]) return values[below];
    return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  };
  return {values.front(), at(0.25), at(0.5), at(0.75)};
}

std::optional<double> observed_order(std::span<const Observation> observations, double floor) {
  std::vector<double> x, y;
  for (const Observation& o : observations) {
    if (!(o.error > floor && o.error < kSaturated && o.h > 0)) continue;
    x.push_back(std::log(o.h));
    y.push_back(std::log(o.error));
  }
  if (x.size() < 3) return std::nullopt;
  const double n = static_cast<double>(x.size());
  const double mean_x = std::accumulate(x.begin(), x.end(), 0.0) / n, mean_y = std::accumulate(y.begin(), y.end(), 0.0) / n;
  double xy = 0, xx = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    xy += (x[k] - mean_x) * (y[k] - mean_y);
    xx += (x[k] - mean_x) * (x[k] - mean_x);
  }
  if (xx == 0) return std::nullopt;
  return xy / xx;
}

std::vector<std::size_t> pareto_front(std::span<const Offer> offers) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < offers.size(); ++k) {
    if (!std::isnan(offers[k].error) && !std::isnan(offers[k].cost)) order.push_back(k);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(offers[a].error, offers[a].cost) < std::pair(offers[b].error, offers[b].cost);
  });
  std::vector<std::size_t> front;
  double cheapest = std::numeric_limits<double>::infinity();
  for (std::size_t k : order) {
    if (offers[k].cost >= cheapest) continue;
    cheapest = offers[k].cost;
    front.push_back(k);
  }
  return front;
}

double relative_l2(std::span<const double> a, std::span<const double> b) {
  assert(a.size() == b.size());
  double difference = 0, size = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    difference += (a[k] - b[k]) * (a[k] - b[k]);
    size += b[k] * b[k];
  }
  return size > 0 ? std::sqrt(difference / size) : std::sqrt(difference);
}

double largest_of_samples(std::span<const double> a, std::span<const double> b, std::size_t size) {
  assert(a.size() == b.size() && size > 0 && a.size() % size == 0);
  double difference = 0, largest = 0;
  for (std::size_t from = 0; from < a.size(); from += size) {
    double d = 0, l = 0;
    for (std::size_t k = from; k < from + size; ++k) {
      d += (a[k] - b[k]) * (a[k] - b[k]);
      l += b[k] * b[k];
    }
    difference = std::max(difference, d);
    largest = std::max(largest, l);
  }
  return largest > 0 ? std::sqrt(difference / largest) : std::sqrt(difference);
}

}  // namespace crumple::lab::chart
