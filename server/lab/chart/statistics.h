#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

// What a chart needs of numbers: spreads of repeated runs, observed orders of convergence, the front of the best.
namespace crumple::lab::chart {

// Smallest value and quartiles (by linear interpolation of the sorted values); NaN where there is none.
struct Spread {
  double low, q1, median, q3;
};
Spread spread(std::vector<double> values);

struct Observation {
  double h;      // step, mesh size: what goes to zero
  double error;
};

// Least-squares slope of log(error) against log(h): p of error ~ h^p. Only errors above `floor` count, being above the
// reference's own uncertainty, and below 0.7, where errors of a signal saturate. Nothing for fewer than three.
std::optional<double> observed_order(std::span<const Observation> observations, double floor);

// Ids of the points that no other beats in both error and cost, by ascending error. Points with a NaN are never in it.
struct Offer {
  double error, cost;
};
std::vector<std::size_t> pareto_front(std::span<const Offer> offers);

// sqrt(sum |a - b|^2 / sum |b|^2) over all entries; both of one size. b = 0: |a| itself.
double relative_l2(std::span<const double> a, std::span<const double> b);

// The maximum over time that goes with it: the largest |a - b| of a sample over the largest |b| of one. `size`: entries
// of a sample; it divides both.
double largest_of_samples(std::span<const double> a, std::span<const double> b, std::size_t size);

}  // namespace crumple::lab::chart
