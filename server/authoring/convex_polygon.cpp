#include "server/authoring/convex_polygon.h"

#include <Eigen/Geometry>

namespace crumple::authoring {

Polygon clip(const Polygon& polygon, const Vec3& normal, double offset) {
  Polygon out;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double ha = normal.dot(a) - offset, hb = normal.dot(b) - offset;
    if (ha <= 0) out.push_back(a);
    if ((ha < 0 && hb > 0) || (ha > 0 && hb < 0)) out.push_back(a + ha / (ha - hb) * (b - a));
  }
  if (out.size() < 3) out.clear();
  return out;
}

Vec3 area_vector(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    sum += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]) / 2;
  return sum;
}

Vec3 area_moment(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    sum += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]).norm() / 2 *
           (polygon[0] + polygon[k] + polygon[k + 1]) / 3;
  return sum;
}

}  // namespace crumple::authoring
