#include "server/authoring/polygon_triangles.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace crumple::authoring {
namespace {

using Vec2 = Eigen::Vector2d;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
double turn(const Vec2& a, const Vec2& b, const Vec2& c) { return cross(b - a, c - a); }  // > 0: to the left

// Newell's: twice the area vector of a loop.
Vec3 area_vector(std::span<const Vec3> points, const std::vector<int>& loop) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < loop.size(); ++k)
    sum += (points[loop[k]] - points[loop[0]]).cross(points[loop[k + 1]] - points[loop[0]]);
  return sum;
}

// A face in its plane. Ids are those of the points.
class FlatFace {
 public:
  FlatFace(std::span<const Vec3> points, const std::vector<std::vector<int>>& loops) : points_(points) {
    Vec3 normal = Vec3::Zero();
    for (const std::vector<int>& loop : loops) normal += area_vector(points, loop);
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    u_ = (axis + 1) % 3;
    v_ = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u_, v_);
    double reach = 0;
    for (const std::vector<int>& loop : loops)
      for (const int p : loop) reach = std::max(reach, (at(p) - at(loops.front().front())).norm());
    same_ = 1e-12 * reach;
  }

  Vec2 at(int p) const { return {points_[p][u_], points_[p][v_]}; }

  // A cut through a vertex leaves several points in its place.
  bool same(int p, int q) const { return (at(p) - at(q)).norm() <= same_; }

  double area(const std::vector<int>& loop) const {
    double twice = 0;
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) twice += turn(at(loop[0]), at(loop[k]), at(loop[k + 1]));
    return twice / 2;
  }

  bool is_convex(const std::vector<int>& loop) const {
    std::vector<int> apart;
    for (const int p : loop)
      if (apart.empty() || !same(p, apart.back())) apart.push_back(p);
    while (apart.size() > 1 && same(apart.front(), apart.back())) apart.pop_back();
    const std::size_t n = apart.size();
    for (std::size_t k = 0; k < n; ++k)
      if (turn(at(apart[k]), at(apart[(k + 1) % n]), at(apart[(k + 2) % n])) < 0) return false;
    return true;
  }

  bool encloses(const std::vector<int>& loop, int p) const {
    const Vec2 q = at(p);
    bool inside = false;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec2 a = at(loop[k]), b = at(loop[(k + 1) % loop.size()]);
      if ((a.y() > q.y()) != (b.y() > q.y()) && (turn(a, b, q) > 0) == (b.y() > a.y())) inside = !inside;
    }
    return inside;
  }

  bool crosses(const std::vector<int>& loop, int p, int q) const {
    const Vec2 a = at(p), b = at(q);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec2 c = at(loop[k]), d = at(loop[(k + 1) % loop.size()]);
      if (turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0) return true;
    }
    return false;
  }

  // One loop that goes to the hole and back.
  void join(std::vector<int>& outer, const std::vector<int>& hole) const {
    double least = std::numeric_limits<double>::infinity();
    std::size_t from = 0, to = 0;
    for (const bool any : {false, true}) {  // a bridge that crosses something rather than none
      for (std::size_t i = 0; i < outer.size(); ++i) {
        for (std::size_t j = 0; j < hole.size(); ++j) {
          const double length = (at(outer[i]) - at(hole[j])).squaredNorm();
          if (length >= least) continue;
          if (!any && (crosses(outer, outer[i], hole[j]) || crosses(hole, outer[i], hole[j]))) continue;
          least = length, from = i, to = j;
        }
      }
      if (least < std::numeric_limits<double>::infinity()) break;
    }
    std::vector<int> way;
    for (std::size_t j = 0; j <= hole.size(); ++j) way.push_back(hole[(to + j) % hole.size()]);
    way.push_back(outer[from]);
    outer.insert(outer.begin() + static_cast<std::ptrdiff_t>(from) + 1, way.begin(), way.end());
  }

  bool is_ear(const std::vector<int>& loop, std::size_t k) const {
    const std::size_t n = loop.size();
    const int a = loop[(k + n - 1) % n], b = loop[k], c = loop[(k + 1) % n];
    if (same(a, b) || same(b, c)) return true;
    if (turn(at(a), at(b), at(c)) <= 0) return false;
    return std::ranges::none_of(loop, [&](int p) {
      if (same(p, a) || same(p, b) || same(p, c)) return false;
      const Vec2 q = at(p);
      return turn(at(a), at(b), q) >= 0 && turn(at(b), at(c), q) >= 0 && turn(at(c), at(a), q) >= 0;
    });
  }

  void cut_ears(std::vector<int> loop, std::vector<Triangle>& out) const {
    if (is_convex(loop)) {
      for (std::size_t k = 1; k + 1 < loop.size(); ++k) out.push_back({loop[0], loop[k], loop[k + 1]});
      return;
    }
    while (loop.size() > 2) {
      std::size_t ear = 0;
      while (ear < loop.size() && !is_ear(loop, ear)) ++ear;
      ear %= loop.size();  // none, by rounding: any
      const std::size_t n = loop.size();
      out.push_back({loop[(ear + n - 1) % n], loop[ear], loop[(ear + 1) % n]});
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(ear));
    }
  }

 private:
  std::span<const Vec3> points_;
  int u_, v_;
  double same_;  // [m]
};

}  // namespace

std::vector<LoopGroup> grouped(std::span<const Vec3> points, const std::vector<std::vector<int>>& loops) {
  if (loops.size() == 1) return {loops};
  const FlatFace face(points, loops);
  std::vector<LoopGroup> groups;
  std::vector<const std::vector<int>*> holes;
  for (const std::vector<int>& loop : loops) {
    if (face.area(loop) >= 0) {
      groups.push_back({loop});
    } else {
      holes.push_back(&loop);
    }
  }
  if (groups.empty()) return {loops};
  for (const std::vector<int>* hole : holes) {
    const auto around = std::ranges::find_if(groups, [&](const LoopGroup& group) { return face.encloses(group.front(), hole->front()); });
    (around == groups.end() ? groups.front() : *around).push_back(*hole);
  }
  return groups;
}

std::vector<Triangle> triangles_of(std::span<const Vec3> points, const LoopGroup& group) {
  const FlatFace face(points, group);
  std::vector<int> around = group.front();
  for (std::size_t hole = 1; hole < group.size(); ++hole) face.join(around, group[hole]);
  std::vector<Triangle> triangles;
  face.cut_ears(std::move(around), triangles);
  return triangles;
}

}  // namespace crumple::authoring
