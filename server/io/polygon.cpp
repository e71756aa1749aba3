#include "server/io/polygon.h"

namespace crumple::io {
namespace {

// Polygons of more corners are cut into fans at once: clipping is cubic in the number of corners.
constexpr std::size_t kMaxClipped = 256;

Vec3 vector_area(std::span<const Vec3> X, const std::vector<int>& ids) {
  Vec3 area = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < ids.size(); ++k) area += (X[ids[k]] - X[ids[0]]).cross(X[ids[k + 1]] - X[ids[0]]);
  return area;
}

bool is_ear(std::span<const Vec3> X, const std::vector<int>& ids, std::size_t k, const Vec3& n) {
  const std::size_t size = ids.size();
  const int ia = ids[(k + size - 1) % size], ib = ids[k], ic = ids[(k + 1) % size];
  const Vec3 &a = X[ia], &b = X[ib], &c = X[ic];
  const auto left = [&](const Vec3& p, const Vec3& q, const Vec3& r) { return n.dot((q - p).cross(r - p)); };
  if (left(a, b, c) <= 0) return false;
  for (const int other : ids) {
    if (other == ia || other == ib || other == ic) continue;
    const Vec3& p = X[other];
    if (left(a, b, p) >= 0 && left(b, c, p) >= 0 && left(c, a, p) >= 0) return false;
  }
  return true;
}

}  // namespace

void cut_polygon(std::span<const Vec3> X, std::vector<int> ids, std::vector<Triangle>& out) {
  const Vec3 n = vector_area(X, ids);
  while (ids.size() > 3 && ids.size() <= kMaxClipped) {
    std::size_t k = 0;
    while (k < ids.size() && !is_ear(X, ids, k, n)) ++k;
    if (k == ids.size()) break;
    out.push_back({ids[(k + ids.size() - 1) % ids.size()], ids[k], ids[(k + 1) % ids.size()]});
    ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(k));
  }
  for (std::size_t k = 1; k + 1 < ids.size(); ++k) out.push_back({ids[0], ids[k], ids[k + 1]});
}

}  // namespace crumple::io
