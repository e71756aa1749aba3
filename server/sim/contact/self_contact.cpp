#include "server/sim/contact/self_contact.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>

namespace crumple::sim::contact {
namespace {

constexpr double kNear = 2;      // of the distance at which two balls touch
constexpr int kPatchTets = 16;   // at most

RestBall ball_about(const Tet& tet, const std::vector<Vec3>& X) {
  RestBall ball{Vec3::Zero(), 0};
  for (const int node : tet) ball.centre += 0.25 * X[node];
  for (const int node : tet) ball.radius = std::max(ball.radius, (X[node] - ball.centre).norm());
  return ball;
}

// Halves the tets where their centres are spread most, until the parts are small.
void add_patches(SelfContact& self, int begin, int end) {
  const std::span<int> tets(self.tets.begin() + begin, self.tets.begin() + end);
  Eigen::AlignedBox3d box;
  for (const int t : tets) box.extend(self.balls[t].centre);
  if (end - begin > kPatchTets) {
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto middle = tets.begin() + (end - begin) / 2;
    std::nth_element(tets.begin(), middle, tets.end(), [&](int a, int b) {
      const double p = self.balls[a].centre[axis], q = self.balls[b].centre[axis];
      return p != q ? p < q : a < b;
    });
    const int half = begin + (end - begin) / 2;
    add_patches(self, begin, half);
    add_patches(self, half, end);
    return;
  }
  std::sort(tets.begin(), tets.end());
  SurfacePatch patch{begin, end, {box.center(), 0}, std::numeric_limits<double>::infinity()};
  for (const int t : tets) {
    patch.ball.radius = std::max(patch.ball.radius, (self.balls[t].centre - patch.ball.centre).norm());
    patch.tet_radius = std::min(patch.tet_radius, self.balls[t].radius);
  }
  self.patches.push_back(patch);
}

}  // namespace

bool near_at_rest(const RestBall& a, const RestBall& b) {
  const double reach = kNear * (a.radius + b.radius);
  return (a.centre - b.centre).squaredNorm() <= reach * reach;
}

bool near_at_rest(const SurfacePatch& a, const SurfacePatch& b) {
  const double farthest = (a.ball.centre - b.ball.centre).norm() + a.ball.radius + b.ball.radius;
  return farthest <= kNear * (a.tet_radius + b.tet_radius);
}

SelfContact make_self_contact(const CollisionMesh& collision, const std::vector<Vec3>& X) {
  SelfContact self;
  self.balls.reserve(collision.tets.size());
  for (const CollisionTet& tet : collision.tets) self.balls.push_back(ball_about(tet.nodes, X));
  for (const CollisionComponent& component : collision.components) {
    self.first_patch.push_back(static_cast<int>(self.patches.size()));
    const int begin = static_cast<int>(self.tets.size());
    self.tets.resize(begin + component.boundary_end - component.begin);
    std::iota(self.tets.begin() + begin, self.tets.end(), component.begin);
    if (component.boundary_end > component.begin) add_patches(self, begin, static_cast<int>(self.tets.size()));
  }
  self.first_patch.push_back(static_cast<int>(self.patches.size()));
  return self;
}

}  // namespace crumple::sim::contact
