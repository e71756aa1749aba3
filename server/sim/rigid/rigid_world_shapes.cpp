#include "server/sim/rigid/rigid_world_shapes.h"

#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <cassert>

#include "server/sim/rigid/convex_hull.h"
#include "server/sim/rigid/rigid_world_hull.h"

namespace crumple::sim::bullet {
namespace {

constexpr int kMaxFacedVertices = 128;  // hulls up to this size get faces, for contacts of several points at once

Pose product(const Pose& X_AB, const Pose& X_BC) { return {(X_AB.R_WB * X_BC.R_WB).normalized(), X_AB * X_BC.p_WB}; }

std::vector<Vec3> moved(const std::vector<Vec3>& points, const Pose& X) {
  std::vector<Vec3> result;
  result.reserve(points.size());
  for (const Vec3& p : points) result.push_back(X * p);
  return result;
}

double smallest_extent(const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  return box.isEmpty() ? 0 : box.sizes().minCoeff();
}

// A flat part has no extent in one direction, and needs some skin.
double skin(double extent) { return std::clamp(0.005 * extent, 1e-5, 1e-3); }

}  // namespace

// Vertices and triangles that Bullet's meshes point into.
struct CollisionShape::Triangles {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  btTriangleIndexVertexArray array;

  explicit Triangles(const SurfaceMesh& mesh)
      : vertices(mesh.vertices),
        triangles(sound_triangles(mesh)),
        array(static_cast<int>(triangles.size()), triangles.data()->data(), sizeof(Triangle),
              static_cast<int>(vertices.size()), vertices.data()->data(), sizeof(Vec3)) {}
};

void CollisionShape::TrianglesDeleter::operator()(Triangles* t) const { delete t; }

template <class T>
T* CollisionShape::own(std::unique_ptr<T> shape) {
  T* raw = shape.get();
  shapes_.push_back(std::move(shape));
  return raw;
}

double CollisionShape::inner_radius() const {
  btVector3 low, high;
  root_->getAabb(btTransform::getIdentity(), low, high);
  const btVector3 size = high - low;
  return std::min({size.x(), size.y(), size.z()}) / 2;
}

btCollisionShape* CollisionShape::add_simple(const Shape& shape) {
  if (const auto* box = std::get_if<Box>(&shape)) {
    auto* result = own(std::make_unique<btBoxShape>(to_bullet(box->half_extents)));
    result->setMargin(std::min(0.01, 0.05 * box->half_extents.minCoeff()));
    return result;
  }
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return own(std::make_unique<btSphereShape>(sphere->radius));
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    const Vec3 half(cylinder->radius, cylinder->half_length, cylinder->radius);
    auto* result = own(std::make_unique<btCylinderShape>(to_bullet(half)));
    result->setMargin(std::min(0.01, 0.05 * half.minCoeff()));
    return result;
  }
  if (const auto* hull = std::get_if<ConvexHull>(&shape)) return add_hull(hull->points);
  if (const auto* plane = std::get_if<Plane>(&shape)) {
    const double length = plane->normal.norm();
    return own(std::make_unique<btStaticPlaneShape>(to_bullet(plane->normal / length), plane->offset / length));
  }
  assert(false && "triangles are added by add_moving_triangles or add_fixed_triangles");
  return nullptr;
}

btCollisionShape* CollisionShape::add_hull(const std::vector<Vec3>& points) {
  // Inner points only cost time; a part that was pressed flat has no hull and keeps its points.
  const Result<SurfaceMesh> hull = convex_hull(points, "");
  const std::vector<Vec3>& kept = hull ? hull->vertices : points;
  auto* shape = own(std::make_unique<Hull>(kept));
  shape->setMargin(skin(smallest_extent(kept)));
  shape->recalcLocalAabb();
  if (hull && kept.size() <= kMaxFacedVertices) shape->set_faces(*hull);
  return shape;
}

btCollisionShape* CollisionShape::add_moving_triangles(const SurfaceMesh& mesh) {
  Triangles& triangles = *triangles_.emplace_back(new Triangles(mesh));
  auto* shape = own(std::make_unique<btGImpactMeshShape>(&triangles.array));
  shape->setMargin(skin(smallest_extent(mesh.vertices)));
  shape->updateBound();
  return shape;
}

btCollisionShape* CollisionShape::add_fixed_triangles(const SurfaceMesh& mesh) {
  Triangles& triangles = *triangles_.emplace_back(new Triangles(mesh));
  edges_ = std::make_unique<EdgeShape>(triangles.vertices, triangles.triangles);
  auto* shape = own(std::make_unique<btBvhTriangleMeshShape>(&triangles.array, true));
  shape->setUserPointer(edges_.get());
  return shape;
}

std::unique_ptr<CollisionShape> moving_shape(const std::vector<PlacedShape>& shapes, const Pose& X_PB) {
  auto result = std::make_unique<CollisionShape>();
  struct Child {
    btCollisionShape* shape;
    Pose X_PS;
  };
  std::vector<Child> children;
  for (const PlacedShape& placed : shapes) {
    const Pose X_PS = product(X_PB, placed.pose);
    if (const auto* hull = std::get_if<ConvexHull>(&placed.shape)) {
      children.push_back({result->add_hull(moved(hull->points, X_PS)), {}});
    } else if (const auto* triangles = std::get_if<TriangleShape>(&placed.shape)) {
      const SurfaceMesh mesh{moved(triangles->mesh.vertices, X_PS), triangles->mesh.triangles};
      children.push_back({result->add_moving_triangles(mesh), {}});
    } else {
      children.push_back({result->add_simple(placed.shape), X_PS});
    }
  }
  const Pose& first = children[0].X_PS;
  if (children.size() == 1 && first.p_WB.isZero(0) && first.R_WB.vec().isZero(0)) {
    result->root_ = children[0].shape;
    return result;
  }
  auto compound = std::make_unique<btCompoundShape>();
  for (const Child& child : children) {
    compound->addChildShape(to_bullet(child.X_PS.R_WB, child.X_PS.p_WB), child.shape);
  }
  result->root_ = result->own(std::move(compound));
  return result;
}

std::unique_ptr<CollisionShape> fixed_shape(const Shape& shape) {
  auto result = std::make_unique<CollisionShape>();
  const auto* triangles = std::get_if<TriangleShape>(&shape);
  result->root_ = triangles ? result->add_fixed_triangles(triangles->mesh) : result->add_simple(shape);
  return result;
}

std::unique_ptr<CollisionShape> deformable_shape(const DeformableShape& shape, const Pose& X_PB) {
  std::vector<PlacedShape> shapes;
  if (const auto* parts = std::get_if<std::vector<ConvexHull>>(&shape)) {
    for (const ConvexHull& part : *parts) shapes.push_back({Pose{}, part});
  } else {
    shapes.push_back({Pose{}, TriangleShape{std::get<SurfaceMesh>(shape)}});
  }
  return moving_shape(shapes, X_PB);
}

}  // namespace crumple::sim::bullet
