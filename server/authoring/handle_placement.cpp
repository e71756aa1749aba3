#include "server/authoring/handle_placement.h"

#include <algorithm>
#include <limits>

namespace crumple::authoring {
namespace {

// The remaining points, each with its nearest other one.
class ClosestPairs {
 public:
  ClosestPairs(const std::vector<Vec3>& X, std::vector<int> ids)
      : X_(X), ids_(std::move(ids)), other_(ids_.size()), d2_(ids_.size()) {
    for (const Vec3& p : X) box_.extend(p);
    for (size_t i = 0; i < ids_.size(); ++i) find_nearest(i);
  }

  void remove_one() {
    const size_t a = std::min_element(d2_.begin(), d2_.end()) - d2_.begin(), b = other_[a];
    const size_t gone = box_distance(a) > box_distance(b) ? a : b;
    alive_[gone] = false;
    d2_[gone] = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < ids_.size(); ++i)
      if (alive_[i] && other_[i] == gone) find_nearest(i);
  }

  std::vector<int> remaining() const {
    std::vector<int> out;
    for (size_t i = 0; i < ids_.size(); ++i)
      if (alive_[i]) out.push_back(ids_[i]);
    return out;
  }

 private:
  void find_nearest(size_t i) {
    d2_[i] = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < ids_.size(); ++k) {
      if (k == i || !alive_[k]) continue;
      const double d2 = (X_[ids_[i]] - X_[ids_[k]]).squaredNorm();
      if (d2 < d2_[i]) {
        d2_[i] = d2;
        other_[i] = k;
      }
    }
  }

  double box_distance(size_t i) const {
    const Vec3& p = X_[ids_[i]];
    return std::min((p - box_.min()).minCoeff(), (box_.max() - p).minCoeff());
  }

  const std::vector<Vec3>& X_;
  std::vector<int> ids_;
  std::vector<size_t> other_;
  std::vector<double> d2_;
  std::vector<char> alive_ = std::vector<char>(ids_.size(), true);
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

std::vector<int> place_handles(const sim::TetMesh& mesh, std::vector<int> ids, int count) {
  constexpr size_t kMostForRemoval = 4000;
  if (ids.size() > kMostForRemoval) {
    ids = farthest_points(mesh.X, ids, std::max<int>(kMostForRemoval, count));
    std::sort(ids.begin(), ids.end());
  }
  ClosestPairs pairs(mesh.X, ids);
  for (int left = static_cast<int>(ids.size()); left > std::max(count, 1); --left) pairs.remove_one();
  return pairs.remaining();
}

std::vector<Vec3> points_of(const sim::TetMesh& mesh, const std::vector<int>& ids) {
  std::vector<Vec3> out;
  for (const int id : ids) out.push_back(mesh.X[id]);
  return out;
}

}  // namespace crumple::authoring
