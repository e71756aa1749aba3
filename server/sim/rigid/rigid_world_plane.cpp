#include "server/sim/rigid/rigid_world_plane.h"

#include <new>

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
  void find(const btCollisionObjectWrapper& convex, const btCollisionObjectWrapper& plane, btManifoldResult& result) {
    const auto& shape = *static_cast<const btStaticPlaneShape*>(plane.getCollisionShape());
    const btTransform to_plane = plane.getWorldTransform().inverseTimes(convex.getWorldTransform());
    const btVector3& n = shape.getPlaneNormal();
    const btVector3 n_world = plane.getWorldTransform().getBasis() * n;
    const btVector3 n_convex = to_plane.getBasis().transpose() * n;
    support_points(*convex.getCollisionShape(), n_convex, [&](int, const btVector3& p, double margin) {
      const btVector3 q = to_plane * p;
      const double distance = n.dot(q) - shape.getPlaneConstant();
      if (distance - margin >= manifold_->getContactBreakingThreshold()) return;
      result.addContactPoint(n_world, plane.getWorldTransform() * (q - distance * n), distance - margin);
    });
  }

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
