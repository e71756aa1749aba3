#include "server/authoring/handle_placement.h"

#include <algorithm>
#include <limits>

namespace crumple::authoring {
namespace {

// The points that remain, each with its nearest other one; the last ones, `given`, stay.
class ClosestPairs {
 public:
  ClosestPairs(const sim::TetMesh& mesh, const std::vector<int>& ids, const HandlePlacement& placement)
      : keep_(placement.keep), removable_(ids.size()) {
    for (const Vec3& p : mesh.X) box_.extend(p);
    for (const int id : ids) points_.push_back(mesh.X[id]);
    points_.insert(points_.end(), placement.given.begin(), placement.given.end());
    alive_.assign(points_.size(), true);
    other_.resize(points_.size());
    d2_.assign(points_.size(), kNever);
    for (size_t i = 0; i < removable_; ++i) find_nearest(i);
  }

  void remove_one() {
    const size_t a = std::min_element(d2_.begin(), d2_.end()) - d2_.begin(), b = other_[a];
    const size_t gone = b >= removable_ ? a : goes_first(a, b);
    alive_[gone] = false;
    d2_[gone] = kNever;
    for (size_t i = 0; i < removable_; ++i)
      if (alive_[i] && other_[i] == gone) find_nearest(i);
  }

  bool remains(size_t i) const { return alive_[i]; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void find_nearest(size_t i) {
    d2_[i] = kNever;
    for (size_t k = 0; k < points_.size(); ++k) {
      if (k == i || !alive_[k]) continue;
      const double d2 = (points_[i] - points_[k]).squaredNorm();
      if (d2 < d2_[i]) {
        d2_[i] = d2;
        other_[i] = k;
      }
    }
  }

  size_t goes_first(size_t a, size_t b) const {
    if (keep_ == KeepHandle::arbitrary) return std::min(a, b);
    return box_distance(a) > box_distance(b) ? a : b;
  }

  double box_distance(size_t i) const {
    return std::min((points_[i] - box_.min()).minCoeff(), (box_.max() - points_[i]).minCoeff());
  }

  KeepHandle keep_;
  size_t removable_;
  std::vector<Vec3> points_;
  std::vector<size_t> other_;
  std::vector<double> d2_;
  std::vector<char> alive_;
  Eigen::AlignedBox3d box_;
};

}  // namespace

std::vector<int> surface_nodes(const std::vector<Tet>& tets) {
  std::vector<int> out;
  for (const sim::SurfaceFace& face : sim::surface_faces(tets))
    out.insert(out.end(), face.nodes.begin(), face.nodes.end());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

std::vector<int> farthest_points(const std::vector<Vec3>& X, const std::vector<int>& ids, int count) {
  Vec3 mean = Vec3::Zero();
  for (const int id : ids) mean += X[id] / static_cast<double>(ids.size());
  std::vector<double> d2;
  for (const int id : ids) d2.push_back((X[id] - mean).squaredNorm());
  std::vector<int> out;
  while (static_cast<int>(out.size()) < std::min<int>(count, static_cast<int>(ids.size()))) {
    const int next = ids[std::max_element(d2.begin(), d2.end()) - d2.begin()];
    for (size_t i = 0; i < ids.size(); ++i) {
      const double d = (X[ids[i]] - X[next]).squaredNorm();
      d2[i] = out.empty() ? d : std::min(d2[i], d);
      if (ids[i] == next) d2[i] = -1;
    }
    out.push_back(next);
  }
  return out;
}

std::vector<int> place_handles(const sim::TetMesh& mesh, std::vector<int> ids, int count,
                               const HandlePlacement& placement) {
  constexpr size_t kMostForRemoval = 4000;
  if (ids.size() > kMostForRemoval) {
    ids = farthest_points(mesh.X, ids, std::max<int>(kMostForRemoval, count));
    std::sort(ids.begin(), ids.end());
  }
  ClosestPairs pairs(mesh, ids, placement);
  const int least = placement.given.empty() ? 1 : 0;
  for (int left = static_cast<int>(ids.size()); left > std::max(count, least); --left) pairs.remove_one();
  std::vector<int> out;
  for (size_t i = 0; i < ids.size(); ++i)
    if (pairs.remains(i)) out.push_back(ids[i]);
  return out;
}

std::vector<Vec3> points_of(const sim::TetMesh& mesh, const std::vector<int>& ids) {
  std::vector<Vec3> out;
  for (const int id : ids) out.push_back(mesh.X[id]);
  return out;
}

}  // namespace crumple::authoring
