#include "server/lab/stability/self_intersections.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace crumple::lab::stability {

namespace {

struct Corners {
  Vec3 a, b, c;
};

// Six times the signed volume of the tet (p, q, r, s).
double volume(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) { return (q - p).cross(r - p).dot(s - p); }

// Whether the segment pq crosses the triangle: its ends lie on either side, and its line passes all edges the same way.
bool pierces(const Vec3& p, const Vec3& q, const Corners& t) {
  if (volume(t.a, t.b, t.c, p) * volume(t.a, t.b, t.c, q) >= 0) return false;
  const double ab = volume(p, q, t.a, t.b), bc = volume(p, q, t.b, t.c), ca = volume(p, q, t.c, t.a);
  return (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
}

bool cut(const Corners& s, const Corners& t) {
  return pierces(s.a, s.b, t) || pierces(s.b, s.c, t) || pierces(s.c, s.a, t) || pierces(t.a, t.b, s) ||
         pierces(t.b, t.c, s) || pierces(t.c, t.a, s);
}

bool share_a_corner(const Triangle& s, const Triangle& t) {
  return std::ranges::any_of(s, [&](int node) { return std::ranges::find(t, node) != t.end(); });
}

}  // namespace

int self_intersections(std::span<const Triangle> triangles, const std::vector<Vec3>& x) {
  int pairs = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const Triangle &s = triangles[i], &t = triangles[k];
      if (share_a_corner(s, t)) continue;
      pairs += cut({x[s[0]], x[s[1]], x[s[2]]}, {x[t[0]], x[t[1]], x[t[2]]});
    }
  return pairs;
}

}  // namespace crumple::lab::stability
