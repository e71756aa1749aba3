#include "server/sim/mesh/tet_tree.h"

#include "server/sim/mesh/tet_faces.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>

namespace crumple::sim {

namespace {

constexpr int kLeafTets = 4;

double squared_distance_to_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 ab = b - a;
  const double s = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (a + s * ab - p).squaredNorm();
}

// The plane's distance where p projects into the triangle, else the nearest edge's.
double squared_distance_to_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 n = (b - a).cross(c - a);
  const bool over = n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
                    n.dot((a - c).cross(p - c)) >= 0;
  if (over && n.squaredNorm() > 0) {
    const double height = n.dot(p - a);
    return height * height / n.squaredNorm();
  }
  return std::min({squared_distance_to_segment(a, b, p), squared_distance_to_segment(b, c, p),
                   squared_distance_to_segment(c, a, p)});
}

}  // namespace

Eigen::Vector4d barycentric(const Mat34& x, const Vec3& p) {
  Mat3 D;
  D << x.col(1) - x.col(0), x.col(2) - x.col(0), x.col(3) - x.col(0);
  const Vec3 b = D.inverse() * (p - x.col(0));
  return {1 - b.sum(), b[0], b[1], b[2]};
}

double squared_distance(const Mat34& x, const Vec3& p) {
  double nearest = 0;
  bool outside = false;
  for (const Triangle& face : kTetFaces) {
    const Vec3 a = x.col(face[0]), b = x.col(face[1]), c = x.col(face[2]);
    if ((p - a).dot((b - a).cross(c - a)) <= 0) continue;  // only faces that p is in front of can be nearest
    const double d = squared_distance_to_triangle(a, b, c, p);
    nearest = outside ? std::min(nearest, d) : d;
    outside = true;
  }
  return nearest;
}

TetTree::TetTree(const TetMesh& mesh) : mesh_(mesh), order_(mesh.tet_count()) {
  assert(mesh.tet_count() > 0);
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Vec3> centroids(mesh.tet_count());
  for (int t = 0; t < mesh.tet_count(); ++t) centroids[t] = rest_corners(mesh, t).rowwise().mean();
  branches_.reserve(2 * order_.size());
  branches_.push_back({{}, 0, mesh.tet_count(), -1});
  build(0, centroids);
}

// Halves the tets by the median of their centroids along the box's longest side; ties fall to the lower id.
void TetTree::build(int branch, std::span<const Vec3> centroids) {
  const int begin = branches_[branch].begin, end = branches_[branch].end;
  Eigen::AlignedBox3d box;
  for (int i = begin; i < end; ++i)
    for (const int node : mesh_.tets[order_[i]]) box.extend(mesh_.X[node]);
  branches_[branch].box = box;
  if (end - begin <= kLeafTets) return;

  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
    return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
  });
  const int left = static_cast<int>(branches_.size());
  branches_[branch].left = left;
  branches_.push_back({{}, begin, middle, -1});
  branches_.push_back({{}, middle, end, -1});
  build(left, centroids);
  build(left + 1, centroids);
}

TetTree::Hit TetTree::nearest(const Vec3& p) const {
  Hit best{-1, std::numeric_limits<double>::infinity()};
  visit(0, branches_[0].box.squaredExteriorDistance(p), p, best);
  return best;
}

std::vector<int> TetTree::near(const Eigen::AlignedBox3d& box) const {
  std::vector<int> found;
  gather(0, box, found);
  std::ranges::sort(found);
  return found;
}

void TetTree::gather(int branch, const Eigen::AlignedBox3d& box, std::vector<int>& found) const {
  const Branch& here = branches_[branch];
  if (!here.box.intersects(box)) return;
  if (here.left >= 0) {
    gather(here.left, box, found);
    gather(here.left + 1, box, found);
    return;
  }
  for (int i = here.begin; i < here.end; ++i) {
    Eigen::AlignedBox3d own;
    for (const int node : mesh_.tets[order_[i]]) own.extend(mesh_.X[node]);
    if (own.intersects(box)) found.push_back(order_[i]);
  }
}

void TetTree::visit(int branch, double box_distance, const Vec3& p, Hit& best) const {
  if (box_distance > best.squared_distance) return;  // an equal one may hold a lower id
  const Branch& here = branches_[branch];
  if (here.left >= 0) {
    const double left = branches_[here.left].box.squaredExteriorDistance(p);
    const double right = branches_[here.left + 1].box.squaredExteriorDistance(p);
    const bool left_first = left <= right;
    visit(here.left + (left_first ? 0 : 1), left_first ? left : right, p, best);
    visit(here.left + (left_first ? 1 : 0), left_first ? right : left, p, best);
    return;
  }
  for (int i = here.begin; i < here.end; ++i) {
    const int t = order_[i];
    const double d = squared_distance(rest_corners(mesh_, t), p);
    if (best.tet < 0 || d < best.squared_distance || (d == best.squared_distance && t < best.tet)) best = {t, d};
  }
}

}  // namespace crumple::sim
