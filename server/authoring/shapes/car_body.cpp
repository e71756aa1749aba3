#include "server/authoring/shapes/car_body.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace crumple::authoring::car {
namespace {

struct Key {
  double x, value;
};

// Through the keys (descending in x) with eased corners: smoothed by averaging the polyline over +-0.06 m.
double along(std::span<const Key> keys, double x) {
  const auto linear = [&](double at) {
    if (at >= keys.front().x) return keys.front().value;
    for (size_t k = 1; k < keys.size(); ++k)
      if (at >= keys[k].x)
        return std::lerp(keys[k].value, keys[k - 1].value, (at - keys[k].x) / (keys[k - 1].x - keys[k].x));
    return keys.back().value;
  };
  double sum = 0;
  for (int k = -3; k <= 3; ++k) sum += linear(x + 0.02 * k);
  return sum / 7;
}

constexpr Key kTop[] = {{2.05, .66},  {1.9, .745},   {1.6, .82},   {.98, .925},   {.22, 1.335},
                        {.05, 1.375}, {-.35, 1.4},   {-.8, 1.375}, {-.98, 1.325}, {-1.52, 1.02},
                        {-1.7, .995}, {-1.98, .975}, {-2.06, .9}};
constexpr Key kBelt[] = {{2.05, .60}, {1.9, .67},  {1.6, .745},  {1.0, .845},
                         {0, .88},    {-1.2, .91}, {-1.9, .905}, {-2.06, .84}};
constexpr Key kHalfWidth[] = {{2.05, .60},  {1.95, .70},  {1.75, .785}, {1.4, .83},  {.6, .845},
                              {-1.0, .845}, {-1.5, .825}, {-1.9, .76},  {-2.06, .66}};
constexpr Key kTopHalfWidth[] = {{2.05, .46}, {1.8, .60},  {1.0, .69},  {.22, .555},
                                 {-.9, .55},  {-1.5, .63}, {-1.9, .60}, {-2.06, .50}};
constexpr Key kSill[] = {{2.05, .30}, {1.8, .245}, {1.0, .22}, {-1.0, .22}, {-1.8, .26}, {-2.06, .34}};
constexpr double kNose = 2.05, kTail = -2.06;

// Lower edge of the side panels: the sill, or the wheel arch over it.
double lower_edge(double x) {
  double y = along(kSill, x);
  for (const double axle : {kFrontAxle, kRearAxle}) {
    const double d = x - axle;
    if (std::abs(d) < kArchRadius) y = std::max(y, kWheelRadius + std::sqrt(kArchRadius * kArchRadius - d * d));
  }
  return y;
}

bool in_window(double x) { return (x < .50 && x > -.27) || (x < -.35 && x > -1.10); }
bool in_windscreen(double x) { return (x < .90 && x > .27) || (x < -1.02 && x > -1.46); }
bool in_door_gap(double x) { return std::min({std::abs(x - .72), std::abs(x + .31), std::abs(x + 1.0)}) < 1e-6; }

// Cross-sections: even ones, and where something begins or ends close pairs (window edges), triples (door gaps) and the
// angles of the wheel arches.
std::vector<double> stations() {
  std::vector<double> x;
  for (int k = 0; k <= 50; ++k) x.push_back(std::lerp(kNose, kTail, k / 50.0));
  for (const double edge : {.50, -.27, -.35, -1.10, .90, .27, -1.02, -1.46})
    for (const double d : {-.007, .007}) x.push_back(edge + d);
  for (const double gap : {.72, -.31, -1.0})
    for (const double d : {-.009, 0.0, .009}) x.push_back(gap + d);
  for (const double axle : {kFrontAxle, kRearAxle})
    for (int k = 0; k <= 14; ++k) x.push_back(axle + kArchRadius * std::cos(std::numbers::pi * k / 14) * .9995);
  std::sort(x.begin(), x.end(), std::greater<>());
  // Even stations that crowd a special one would only make slivers.
  std::vector<double> out;
  for (const double at : x)
    if (out.empty() || out.back() - at > .0055) out.push_back(at);
  return out;
}

struct Section {
  std::vector<Vec3> points;  // right half (z >= 0) from the underside's middle to the roof's
  std::vector<double> sink;  // how far each is set back into the body [m]
};

Section half_section(double x) {
  const double top = along(kTop, x), belt = along(kBelt, x), wide = along(kHalfWidth, x), sill = along(kSill, x);
  const double lower = lower_edge(x), top_wide = std::min(along(kTopHalfWidth, x), wide - .1);
  const double top_edge = std::max(belt + .045, top - .045);
  Section s;
  const auto add = [&](double y, double z, double sink = 0) {
    s.points.push_back({x, y, z});
    s.sink.push_back(sink);
  };
  add(sill, 0);
  add(sill, .30);
  add(sill, wide - .29);
  add(std::lerp(sill, lower, .999) + .001, wide - .27);  // inner wall of the wheel arch
  add(lower + .001, wide - .10);
  add(lower + .002, wide - .02);
  const double gap = in_door_gap(x) ? .014 : 0;
  for (const double f : {.06, .2, .4, .6, .66, .85}) {  // the side, bulging, with a crease at two thirds
    const double bulge = .018 * std::sin(std::numbers::pi * std::min(f, .66) / .66 / 1.6) - (f > .62 ? .012 : 0);
    add(std::lerp(lower, belt, f), wide - .015 + bulge, lower < .35 ? gap : 0);
  }
  add(belt, wide - .02);
  add(belt + .018, wide - .05);
  const double w0y = belt + .028, w0z = wide - .075;
  const bool glass = in_window(x) && top_edge - belt > .12;
  for (const double f : {.06, .10, .5, .88, .93}) {
    const bool inner = f > .08 && f < .9;
    add(std::lerp(w0y, top_edge, f), std::lerp(w0z, top_wide, f), glass && inner ? .022 : 0);
  }
  add(top_edge, top_wide);
  const bool screen = in_windscreen(x);
  for (const double f : {.93, .90, .6, .3, 0.0}) {  // the roof, the bonnet or the boot lid, crowned
    const bool inner = f < .92;
    add(top_edge + (top - top_edge) * (1 - f * f), top_wide * f, screen && inner ? .022 : 0);
  }
  return s;
}

// Both halves as one loop: below, right side, roof, left side.
struct Loop {
  std::vector<Vec3> points;
  std::vector<double> sink;
};

Loop whole_section(double x) {
  const Section half = half_section(x);
  const int n = static_cast<int>(half.points.size());
  Loop loop{half.points, half.sink};
  for (int k = n - 2; k > 0; --k) {
    loop.points.push_back(half.points[k].cwiseProduct(Vec3(1, 1, -1)));
    loop.sink.push_back(half.sink[k]);
  }
  return loop;
}

Vec3 grid_normal(const std::vector<Loop>& loops, int i, int k) {
  const int n = static_cast<int>(loops[i].points.size());
  const int before = std::max(i - 1, 0), after = std::min<int>(i + 1, static_cast<int>(loops.size()) - 1);
  const Vec3 along_x = loops[before].points[k] - loops[after].points[k];  // towards +x
  const Vec3 around = loops[i].points[(k + 1) % n] - loops[i].points[(k + n - 1) % n];
  return along_x.cross(around).normalized();
}

void sink_panels(std::vector<Loop>& loops) {
  const std::vector<Loop> flush = loops;
  for (int i = 0; i < static_cast<int>(loops.size()); ++i)
    for (int k = 0; k < static_cast<int>(loops[i].points.size()); ++k)
      if (loops[i].sink[k] > 0) loops[i].points[k] -= loops[i].sink[k] * grid_normal(flush, i, k);
}

// Rounds off an end: ever smaller copies of its section, the last one a point.
std::vector<Loop> end_cap(const Loop& end, double outward) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : end.points) middle += p / static_cast<double>(end.points.size());
  std::vector<Loop> out;
  for (const auto& [scale, bulge] : {std::pair(.96, .016), {.85, .030}, {.5, .036}}) {
    Loop ring = end;
    for (Vec3& p : ring.points) p = middle + scale * (p - middle) + Vec3(outward * bulge, 0, 0);
    out.push_back(ring);
  }
  return out;
}

}  // namespace

sim::SurfaceMesh body_shell() {
  std::vector<Loop> loops;
  for (const double x : stations()) loops.push_back(whole_section(x));
  sink_panels(loops);
  const std::vector<Loop> nose = end_cap(loops.front(), 1), tail = end_cap(loops.back(), -1);
  loops.insert(loops.begin(), nose.rbegin(), nose.rend());
  loops.insert(loops.end(), tail.begin(), tail.end());

  sim::SurfaceMesh out;
  const int n = static_cast<int>(loops.front().points.size()), rings = static_cast<int>(loops.size());
  for (const Loop& loop : loops) out.vertices.insert(out.vertices.end(), loop.points.begin(), loop.points.end());
  const auto at = [&](int ring, int k) { return ring * n + k % n; };
  for (int ring = 0; ring + 1 < rings; ++ring)
    for (int k = 0; k < n; ++k) {
      out.triangles.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)});
      out.triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)});
    }
  for (const int ring : {0, rings - 1}) {
    Vec3 middle = Vec3::Zero();
    for (int k = 0; k < n; ++k) middle += out.vertices[at(ring, k)] / n;
    const int pole = static_cast<int>(out.vertices.size());
    out.vertices.push_back(middle);
    for (int k = 0; k < n; ++k)
      out.triangles.push_back(ring == 0 ? Triangle{pole, at(ring, k + 1), at(ring, k)}
                                        : Triangle{pole, at(ring, k), at(ring, k + 1)});
  }
  return out;
}

}  // namespace crumple::authoring::car
