#pragma once

#include "server/lab/chart/study.h"

#include <optional>
#include <string>
#include <vector>

// What the points of a study say, in words.
namespace crumple::lab::chart {

struct Order {
  std::string curve;
  double observed, expected;
  bool met() const { return observed > expected - 0.25 && observed < expected + 0.5; }
};
// Of the curves that state one and have three points above the floor.
std::vector<Order> orders(const Study& study, const std::vector<Point>& points);

// The cheapest point whose error, or another quantity, is at most `error`; null if none is. Failed points never are.
const Point* cheapest(const std::vector<Point>& points, double error, const std::string& quantity = "error");

// The reference's own uncertainty as the points report it: the same for all of a study, or each has its own.
struct Floors {
  double least = 0, most = 0;
  double common() const { return least == most ? most : 0; }
};
Floors floors_of(const std::vector<Point>& points);

// Which part of the error is the largest: "solver", "time", "mesh", or "" where the parts were not measured.
std::string dominating_part(const Point& point);

// A plain paragraph, generated from the points.
std::string conclusion(const Study& study, const std::vector<Point>& points);

// Two significant digits, as a percentage where that reads well: "3.2 %", "0.041 %", "4e-07".
std::string as_error(double error);
std::string as_seconds(double seconds);

}  // namespace crumple::lab::chart
