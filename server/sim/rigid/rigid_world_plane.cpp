#include "server/sim/rigid/rigid_world_plane.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <new>
#include <vector>

#include "server/sim/rigid/rigid_world_support.h"

namespace crumple::sim::bullet {
namespace {

class PlaneContact : public btCollisionAlgorithm {
 public:
  PlaneContact(btPersistentManifold* shared, const btCollisionAlgorithmConstructionInfo& info,
               const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, bool plane_first)
      : btCollisionAlgorithm(info), manifold_(shared), plane_first_(plane_first) {
    const btCollisionObject* convex = (plane_first ? b : a)->getCollisionObject();
    const btCollisionObject* plane = (plane_first ? a : b)->getCollisionObject();
    if (!manifold_ && m_dispatcher->needsCollision(convex, plane)) {
      manifold_ = m_dispatcher->getNewManifold(convex, plane);
      owned_ = true;
    }
  }
  ~PlaneContact() override {
    if (owned_) m_dispatcher->releaseManifold(manifold_);
  }

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b, const btDispatcherInfo&,
                        btManifoldResult* result) override {
    if (!manifold_) return;
    const btCollisionObjectWrapper* convex = plane_first_ ? b : a;
    const btCollisionObjectWrapper* plane = plane_first_ ? a : b;
    result->setPersistentManifold(manifold_);
    find(*convex, *plane, *result);
    if (owned_ && manifold_->getNumContacts()) result->refreshContactPoints();
  }

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    if (owned_) manifolds.push_back(manifold_);
  }

 private:
  struct Near {
    int k;           // of support_points
    btVector3 foot;  // in the plane's axes, on the plane
    double gap;      // [m]
  };

  void find(const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& plane, btManifoldResult& result) {
    const auto& shape = *static_cast<const btStaticPlaneShape*>(plane.getCollisionShape());
    const btTransform to_plane = plane.getWorldTransform().inverseTimes(convex.getWorldTransform());
    const btVector3& n = shape.getPlaneNormal();
    const btVector3 n_world = plane.getWorldTransform().getBasis() * n;
    const btVector3 n_convex = to_plane.getBasis().transpose() * n;
    const double threshold = manifold_->getContactBreakingThreshold();
    own_->near.clear();
    support_points(*convex.getCollisionShape(), n_convex, [&](int k, const btVector3& p, double margin) {
      const btVector3 q = to_plane * p;
      const double distance = n.dot(q) - shape.getPlaneConstant();
      if (distance - margin < threshold) own_->near.push_back({k, q - distance * n, distance - margin});
    });
    if (own_->near.size() > kPoints) keep_few(n, threshold);
    own_->kept.clear();
    for (const Near& point : own_->near) {
      own_->kept.push_back(point.k);
      result.addContactPoint(n_world, plane.getWorldTransform() * point.foot, point.gap);
    }
  }

  // Bullet keeps four points of a pair, and each one more throws out another with the impulse that it starts from: a barrel that
  // stood on a ring of forty rocked on other four of them in every step. So four are chosen here, and stay until
  // another is clearly deeper than all of them.
  void keep_few(const btVector3& n, double threshold) {
    const auto is_kept = [&](const Near& point) { return std::ranges::find(own_->kept, point.k) != own_->kept.end(); };
    const double deepest = std::ranges::min(own_->near, {}, &Near::gap).gap;
    std::vector<Near> chosen;
    std::ranges::copy_if(own_->near, std::back_inserter(chosen), is_kept);
    if (chosen.size() < kPoints || std::ranges::min(chosen, {}, &Near::gap).gap > deepest + kClearly * threshold) choose(n, threshold, chosen);
    own_->near.swap(chosen);
  }

  // The deepest, the farthest from it, and on either side of the line between them the farthest from that, of those about as deep.
  void choose(const btVector3& n, double threshold, std::vector<Near>& chosen) {
    std::ranges::stable_sort(own_->near, {}, &Near::gap);
    const double limit = own_->near.front().gap + kAboutAsDeep * threshold;
    std::size_t count = kPoints;
    while (count < own_->near.size() && own_->near[count].gap <= limit) ++count;
    own_->near.resize(count);
    const btVector3 a = own_->near[0].foot;
    const auto farthest = [&](const auto& distance) { return *std::ranges::max_element(own_->near, {}, [&](const Near& p) { return distance(p.foot); }); };
    const Near b = farthest([&](const btVector3& p) { return (p - a).length2(); });
    const auto side = [&](const btVector3& p) { return n.dot((b.foot - a).cross(p - a)); };
    chosen = {own_->near[0], b, farthest(side), farthest([&](const btVector3& p) { return -side(p); })};
    // Points in one line: those on either side are the ends again.
    std::vector<Near> distinct;
    for (const Near& point : chosen)
      if (std::ranges::find(distinct, point.k, &Near::k) == distinct.end()) distinct.push_back(point);
    chosen.swap(distinct);
  }

  static constexpr std::size_t kPoints = 4;
  static constexpr double kClearly = 0.005, kAboutAsDeep = 0.1;  // of the contact breaking threshold
  struct Own {
    std::vector<Near> near;
    std::vector<int> kept;  // points of the last time
  };
  std::unique_ptr<Own> own_ = std::make_unique<Own>();  // apart: Bullet's pool has room for its own algorithms' size

  btPersistentManifold* manifold_;
  bool plane_first_;
  bool owned_ = false;
};

}  // namespace

btCollisionAlgorithm* PlaneContactFactory::Create::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                                            const btCollisionObjectWrapper* a,
                                                                            const btCollisionObjectWrapper* b) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(PlaneContact));
  return new (memory) PlaneContact(info.m_manifold, info, a, b, m_swapped);
}

void PlaneContactFactory::register_with(btCollisionDispatcher& dispatcher) {
  plane_first_.m_swapped = true;
  for (const int type : {BOX_SHAPE_PROXYTYPE, kHullType, SPHERE_SHAPE_PROXYTYPE,
                         CYLINDER_SHAPE_PROXYTYPE, GIMPACT_SHAPE_PROXYTYPE}) {
    dispatcher.registerCollisionCreateFunc(type, STATIC_PLANE_PROXYTYPE, &convex_first_);
    dispatcher.registerCollisionCreateFunc(STATIC_PLANE_PROXYTYPE, type, &plane_first_);
    dispatcher.registerClosestPointsCreateFunc(type, STATIC_PLANE_PROXYTYPE, &convex_first_);
    dispatcher.registerClosestPointsCreateFunc(STATIC_PLANE_PROXYTYPE, type, &plane_first_);
  }
}

}  // namespace crumple::sim::bullet
