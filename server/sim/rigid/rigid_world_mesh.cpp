#include "server/sim/rigid/rigid_world_mesh.h"

#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>

#include <algorithm>
#include <new>
#include <vector>

#include "server/sim/rigid/rigid_world_shapes.h"
#include "server/sim/rigid/rigid_world_support.h"

namespace crumple::sim::bullet {
namespace {

// Passes on what lies on an edge that sticks out.
class RidgeResult : public btManifoldResult {
 public:
  RidgeResult(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
              const btCollisionObjectWrapper* mesh)
      : btManifoldResult(a, b),
        mesh_(mesh),
        edges_(*static_cast<const EdgeShape*>(mesh->getCollisionShape()->getUserPointer())) {}

  // The normal points from the mesh to the convex shape, p is on the mesh.
  void addContactPoint(const btVector3& normal, const btVector3& p, btScalar depth) override {
    const int triangle = getBody0Internal() == mesh_->getCollisionObject() ? m_index0 : m_index1;
    const btTransform& X_WM = mesh_->getWorldTransform();
    const Vec3 p_M = from_bullet(X_WM.invXform(p)), n_M = from_bullet(X_WM.getBasis().transpose() * normal);
    if (triangle < 0 || triangle >= edges_.triangle_count() || !edges_.on_ridge(triangle, p_M, n_M)) return;
    btManifoldResult::addContactPoint(normal, p, depth);
  }

 private:
  const btCollisionObjectWrapper* mesh_;
  const EdgeShape& edges_;
};

// Support points of the convex shape that lie over (or under) a triangle, in the mesh's axes.
class FacePoints : public btTriangleCallback {
 public:
  struct Touch {
    int k;        // number of the support point
    btVector3 n;  // of the face, on the side of the shape's centre
    btVector3 p;  // on the face
    double distance;
  };

  FacePoints(const btCollisionShape& shape, const btTransform& X_MC, double reach)
      : shape_(shape), X_MC_(X_MC), reach_(reach) {
    btVector3 low, high;
    shape.getAabb(btTransform::getIdentity(), low, high);
    centre_ = X_MC * ((low + high) / 2);
    depth_ = 0.25 * std::min({high.x() - low.x(), high.y() - low.y(), high.z() - low.z()});
  }

  void processTriangle(btVector3* corner, int, int) override {
    const btVector3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const double area = normal.length();
    const btVector3 n = normal / ((centre_ - corner[0]).dot(normal) < 0 ? -area : area);
    support_points(shape_, X_MC_.getBasis().transpose() * n, [&](int k, const btVector3& point, double margin) {
      const btVector3 q = X_MC_ * point;
      const double height = n.dot(q - corner[0]);
      if (height - margin >= reach_ || height - margin < -depth_) return;
      const btVector3 p = q - height * n;
      for (int i = 0; i < 3; ++i) {  // barycentric coordinate of corner i + 2
        const double share = (corner[(i + 1) % 3] - corner[i]).cross(p - corner[i]).dot(normal) / (area * area);
        if (share < -1e-9) return;
      }
      touches_.push_back({k, n, p, height - margin});
    });
  }

  // A point inside the solid is felt by the face that is its shortest way out, only.
  template <class Offer>
  void offer_to(const Offer& offer) const {
    for (const Touch& touch : touches_) {
      bool shallowest = true;
      for (const Touch& other : touches_) {
        if (touch.distance < 0 && other.k == touch.k && other.distance < 0 && other.distance > touch.distance)
          shallowest = false;
      }
      if (shallowest) offer(touch);
    }
  }

 private:
  const btCollisionShape& shape_;
  const btTransform& X_MC_;
  double reach_, depth_;
  btVector3 centre_;
  std::vector<Touch> touches_;
};

class MeshContact : public btConvexConcaveCollisionAlgorithm {
 public:
  MeshContact(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper* a,
              const btCollisionObjectWrapper* b, bool mesh_first)
      : btConvexConcaveCollisionAlgorithm(info, a, b, mesh_first), mesh_first_(mesh_first) {}

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override {
    const btCollisionObjectWrapper* convex = mesh_first_ ? b : a;
    const btCollisionObjectWrapper* mesh = mesh_first_ ? a : b;
    RidgeResult ridges(a, b, mesh);
    ridges.m_closestPointDistanceThreshold = result->m_closestPointDistanceThreshold;
    btConvexConcaveCollisionAlgorithm::processCollision(a, b, info, &ridges);

    btManifoldArray manifolds;
    getAllContactManifolds(manifolds);
    if (manifolds.size() == 0) return;
    btManifoldResult faces(a, b);
    faces.setPersistentManifold(manifolds[0]);
    const double reach = manifolds[0]->getContactBreakingThreshold();
    const btTransform& X_WM = mesh->getWorldTransform();
    const btTransform X_MC = X_WM.inverseTimes(convex->getWorldTransform());
    FacePoints points(*convex->getCollisionShape(), X_MC, reach);
    btVector3 low, high;
    convex->getCollisionShape()->getAabb(X_MC, low, high);
    const btVector3 margin(reach, reach, reach);
    static_cast<const btConcaveShape*>(mesh->getCollisionShape())
        ->processAllTriangles(&points, low - margin, high + margin);
    points.offer_to([&](const FacePoints::Touch& touch) {
      faces.addContactPoint(X_WM.getBasis() * touch.n, X_WM * touch.p, touch.distance);
    });
    faces.refreshContactPoints();
  }

 private:
  bool mesh_first_;
};

}  // namespace

btCollisionAlgorithm* MeshContactFactory::Create::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                                           const btCollisionObjectWrapper* a,
                                                                           const btCollisionObjectWrapper* b) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(MeshContact));
  return new (memory) MeshContact(info, a, b, m_swapped);
}

void MeshContactFactory::register_with(btCollisionDispatcher& dispatcher) {
  mesh_first_.m_swapped = true;
  for (const int type :
       {BOX_SHAPE_PROXYTYPE, kHullType, SPHERE_SHAPE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE}) {
    dispatcher.registerCollisionCreateFunc(type, TRIANGLE_MESH_SHAPE_PROXYTYPE, &convex_first_);
    dispatcher.registerCollisionCreateFunc(TRIANGLE_MESH_SHAPE_PROXYTYPE, type, &mesh_first_);
  }
}

}  // namespace crumple::sim::bullet
