#include "server/authoring/winding_number.h"

#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

constexpr double kFourPi = 4 * std::numbers::pi;

// tan(Omega / 2) of solid_angle, as the two arguments of atan2.
double half_solid_angle(const Vec3& q, const std::array<Vec3, 3>& corners) {
  const Vec3 a = corners[0] - q, b = corners[1] - q, c = corners[2] - q;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double numerator = a.dot(b.cross(c));
  if (numerator == 0) return 0;  // seen edge-on, or degenerate
  return std::atan2(numerator, la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

double solid_angle(const Vec3& q, const std::array<Vec3, 3>& corners) { return 2 * half_solid_angle(q, corners); }

WindingNumber::WindingNumber(const sim::SurfaceMesh& surface) : tree_(surface) {
  for (const TriangleBvh::Node& node : tree_.nodes) {
    Vec3 moment = Vec3::Zero(), weighted = Vec3::Zero();
    double area = 0;
    for (int k = node.first; k < node.first + node.count; ++k) {
      const auto& [a, b, c] = tree_.corners[k];
      const Vec3 normal = (b - a).cross(c - a) / 2;
      moment += normal;
      weighted += normal.norm() * (a + b + c) / 3;
      area += normal.norm();
    }
    const Vec3 centre = area > 0 ? Vec3(weighted / area) : Vec3((node.lower + node.upper) / 2);
    double radius2 = 0;
    for (int k = node.first; k < node.first + node.count; ++k)
      for (const Vec3& corner : tree_.corners[k]) radius2 = std::max(radius2, (corner - centre).squaredNorm());
    dipoles_.push_back({centre, moment / kFourPi, kAccuracy * kAccuracy * radius2});
  }
}

double WindingNumber::operator()(const Vec3& q) const {
  double dipole_sum = 0, half_angles = 0;
  // Depth of a median split over at most 5 million triangles is below 24; each level leaves one node behind.
  std::array<int, 64> stack;
  int top = 0;
  if (!dipoles_.empty()) stack[top++] = 0;
  while (top > 0) {
    const int id = stack[--top];
    const Dipole& dipole = dipoles_[id];
    const Vec3 r = dipole.centre - q;
    const double r2 = r.squaredNorm();
    if (r2 > dipole.reach) {
      dipole_sum += dipole.moment.dot(r) / (r2 * std::sqrt(r2));
    } else if (const TriangleBvh::Node& node = tree_.nodes[id]; node.leaf()) {
      for (int k = node.first; k < node.first + node.count; ++k) half_angles += half_solid_angle(q, tree_.corners[k]);
    } else {
      stack[top++] = node.right;
      stack[top++] = id + 1;
    }
  }
  return dipole_sum + 2 * half_angles / kFourPi;
}

double WindingNumber::exact(const Vec3& q) const {
  double half_angles = 0;
  for (const auto& corners : tree_.corners) half_angles += half_solid_angle(q, corners);
  return 2 * half_angles / kFourPi;
}

}  // namespace crumple::authoring
