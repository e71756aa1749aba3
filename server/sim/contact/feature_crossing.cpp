#include "server/sim/contact/feature_crossing.h"

#include <cmath>
#include <utility>

namespace crumple::sim::contact {
namespace {

constexpr double kOver = 1e-7;        // [-]: a feature reaches so far over its ends that none slips between two
constexpr int kBisections = 60;

double det(const Vec3& a, const Vec3& b, const Vec3& c) { return a.cross(b).dot(c); }

// c0 + c1 t + c2 t^2 + c3 t^3
struct Cubic {
  std::array<double, 4> c;
  double operator()(double t) const { return ((c[3] * t + c[2]) * t + c[1]) * t + c[0]; }
};

// Of the tetrahedron of the four points, six times its volume.
Cubic volume_in_time(const Mat34& p, const Mat34& d) {
  const Vec3 e1 = p.col(1) - p.col(0), e2 = p.col(2) - p.col(0), e3 = p.col(3) - p.col(0);
  const Vec3 g1 = d.col(1) - d.col(0), g2 = d.col(2) - d.col(0), g3 = d.col(3) - d.col(0);
  return {{det(e1, e2, e3), det(g1, e2, e3) + det(e1, g2, e3) + det(e1, e2, g3),
           det(g1, g2, e3) + det(g1, e2, g3) + det(e1, g2, g3), det(g1, g2, g3)}};
}

// Where the cubic turns, ascending, within (from, 1); between them it is monotone.
int turning_points(const Cubic& f, double from, std::array<double, 2>& at) {
  const double a = 3 * f.c[3], b = 2 * f.c[2], c = f.c[1];
  const double under_root = b * b - 4 * a * c;
  if (under_root < 0) return 0;
  const double q = -0.5 * (b + std::copysign(std::sqrt(under_root), b));
  int count = 0;
  for (const double t : {q / a, c / q})  // q or a may be 0: then that root is not there
    if (std::isfinite(t) && t > from && t < 1) at[count++] = t;
  if (count == 2 && at[1] < at[0]) std::swap(at[0], at[1]);
  return count;
}

double root_between(const Cubic& f, double low, double high) {
  const bool falls = f(low) > 0;
  for (int k = 0; k < kBisections && low < high; ++k) {
    const double middle = 0.5 * (low + high);
    ((f(middle) > 0) == falls ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

template <class Meet>
FeatureCrossings crossings(const Mat34& p, const Mat34& d, double from, Meet meet) {
  FeatureCrossings result;
  const CoplanarTimes times = coplanar_times(p, d, from);
  for (int k = 0; k < times.count; ++k) {
    FeatureCrossing& crossing = result.at[result.count];
    crossing.t = times.t[k];
    if (meet(Mat34(p + crossing.t * d), crossing)) ++result.count;
  }
  return result;
}

}  // namespace

CoplanarTimes coplanar_times(const Mat34& p, const Mat34& d, double from) {
  const Cubic f = volume_in_time(p, d);
  CoplanarTimes result;
  std::array<double, 2> turns{};
  const int count = turning_points(f, from, turns);
  double low = from;
  for (int k = 0; k <= count; ++k) {
    const double high = k < count ? turns[k] : 1;
    const double at_low = f(low), at_high = f(high);
    // A root on the border of two intervals belongs to the first of them.
    const bool crosses = at_low * at_high < 0 || (at_high == 0 && at_low != 0) || (k == 0 && at_low == 0 && at_high != 0);
    if (crosses) result.t[result.count++] = at_low == 0 ? low : at_high == 0 ? high : root_between(f, low, high);
    low = high;
  }
  return result;
}

FeatureCrossings node_through_triangle(const Mat34& p, const Mat34& d, double from) {
  return crossings(p, d, from, [&](const Mat34& x, FeatureCrossing& at) {
    const Vec3 e1 = x.col(2) - x.col(1), e2 = x.col(3) - x.col(1), r = x.col(0) - x.col(1), n = e1.cross(e2);
    const double twice_area = n.norm();
    if (!(twice_area > 0)) return false;
    const double b2 = r.cross(e2).dot(n) / (twice_area * twice_area), b3 = e1.cross(r).dot(n) / (twice_area * twice_area);
    if (!(b2 >= -kOver && b3 >= -kOver && b2 + b3 <= 1 + kOver)) return false;
    at.weights << 1, 1 - b2 - b3, b2, b3;
    at.normal = n / twice_area;
    at.relative = d.col(0) - d.rightCols<3>() * at.weights.tail<3>();
    return true;
  });
}

FeatureCrossings edge_through_edge(const Mat34& p, const Mat34& d, double from) {
  return crossings(p, d, from, [&](const Mat34& x, FeatureCrossing& at) {
    const Vec3 e = x.col(1) - x.col(0), g = x.col(3) - x.col(2), r = x.col(2) - x.col(0), n = e.cross(g);
    const double squared = n.squaredNorm();
    if (!(squared > 1e-12 * e.squaredNorm() * g.squaredNorm())) return false;  // parallel: their ends are nodes that meet
    const double s = det(r, g, n) / squared, t = det(r, e, n) / squared;
    if (!(s >= -kOver && s <= 1 + kOver && t >= -kOver && t <= 1 + kOver)) return false;
    at.weights << 1 - s, s, 1 - t, t;
    at.normal = n / std::sqrt(squared);
    at.relative = d.leftCols<2>() * at.weights.head<2>() - d.rightCols<2>() * at.weights.tail<2>();
    return true;
  });
}

}  // namespace crumple::sim::contact
