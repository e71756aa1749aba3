#include "server/sim/example_based/hull_points.h"

#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace crumple::sim::example_based {
namespace {

constexpr int kRestDirections = 320, kExampleDirections = 200;
constexpr double kRestShortfall = 1e-3, kExampleShortfall = 5e-3;  // of the part's size

// The 26 directions of a box's faces, edges and corners, then a Fibonacci spiral over the sphere.
std::vector<Vec3> directions(int count) {
  std::vector<Vec3> result;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) result.push_back(Vec3(x, y, z).normalized());
  std::stable_sort(result.begin(), result.end(), [](const Vec3& a, const Vec3& b) {
    return a.cwiseAbs().minCoeff() > b.cwiseAbs().minCoeff();  // corners first: they make most others unnecessary
  });
  const int spiral = count - static_cast<int>(result.size());
  for (int k = 0; k < spiral; ++k) {
    const double y = 1 - (2 * k + 1.0) / spiral, angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const double radius = std::sqrt(1 - y * y);
    result.emplace_back(radius * std::cos(angle), y, radius * std::sin(angle));
  }
  return result;
}

// Adds to `chosen` (indices of x) what it lacks to reach as far as all of x, less `shortfall` [m].
void reach_as_far(std::span<const Vec3> x, std::span<const Vec3> directions, double shortfall,
                  std::vector<int>& chosen) {
  for (const Vec3& n : directions) {
    double reach = -std::numeric_limits<double>::infinity();
    for (int c : chosen) reach = std::max(reach, n.dot(x[c]));
    int farthest = 0;
    double farthest_reach = n.dot(x[0]);
    for (int k = 1; k < static_cast<int>(x.size()); ++k)
      if (const double along = n.dot(x[k]); along > farthest_reach) {
        farthest = k;
        farthest_reach = along;
      }
    if (farthest_reach > reach + shortfall) chosen.push_back(farthest);
  }
}

}  // namespace

std::vector<int> hull_candidates(const ExampleRest& rest, std::span<const int> part) {
  assert(part.size() >= 4);
  std::vector<int> chosen;
  std::vector<Vec3> x(part.size());
  for (int e = 0; e < rest.example_count(); ++e) {
    Eigen::AlignedBox3d box;
    for (std::size_t k = 0; k < part.size(); ++k) {
      x[k] = e == 0 ? rest.x_rest[part[k]] : skin_in_example(rest, part[k], e);
      box.extend(x[k]);
    }
    const double size = box.diagonal().norm();
    if (e == 0)
      reach_as_far(x, directions(kRestDirections), kRestShortfall * size, chosen);
    else
      reach_as_far(x, directions(kExampleDirections), kExampleShortfall * size, chosen);
  }
  std::vector<int> result;
  for (int c : chosen) result.push_back(part[c]);
  for (std::size_t k = 0; result.size() < 4 && k < part.size(); ++k) result.push_back(part[k]);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

void hull_points(const ExampleRest& rest, const ExampleState& state, int p, std::vector<Vec3>& points) {
  const std::vector<int>& vertices = rest.hull_vertices[p];
  points.resize(vertices.size());
  for (std::size_t k = 0; k < vertices.size(); ++k) points[k] = state.x[vertices[k]];
}

}  // namespace crumple::sim::example_based
