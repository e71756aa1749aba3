#pragma once

#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>

#include <cmath>
#include <utility>

#include "server/sim/rigid/rigid_world_hull.h"

// Private to rigid_world.
namespace crumple::sim::bullet {

// Calls offer(k, p, margin) for points p of a shape, in its axes, that alone can be the first to touch a face of
// normal n (in its axes, pointing towards the shape); the surface lies `margin` beyond p. Vertices of boxes, hulls and
// triangle meshes; the centre of a sphere; of a cylinder four points of each rim: the lowest along n and every quarter
// from it. k numbers them. False for other shapes.
template <class Offer>
bool support_points(const btCollisionShape& shape, const btVector3& n, const Offer& offer) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      offer(0, btVector3(0, 0, 0), static_cast<const btSphereShape&>(shape).getRadius());
      return true;
    case CYLINDER_SHAPE_PROXYTYPE: {
      const btVector3 half = static_cast<const btCylinderShape&>(shape).getHalfExtentsWithMargin();
      const double across = std::hypot(n.x(), n.z()), r = half.x();
      const double c = across > 1e-9 ? -n.x() / across : 1, s = across > 1e-9 ? -n.z() / across : 0;
      int k = 0;
      for (const double y : {-half.y(), half.y()}) {
        for (const auto& [x, z] : {std::pair(c, s), std::pair(-s, c), std::pair(-c, -s), std::pair(s, -c)}) {
          offer(k++, btVector3(r * x, y, r * z), 0);
        }
      }
      return true;
    }
    case GIMPACT_SHAPE_PROXYTYPE: {
      const auto& mesh = static_cast<const btGImpactMeshShape&>(shape);
      int k = 0;
      for (int part = 0; part < mesh.getMeshPartCount(); ++part) {
        const btGImpactMeshShapePart* vertices = mesh.getMeshPart(part);
        vertices->lockChildShapes();
        for (int i = 0; i < vertices->getVertexCount(); ++i) {
          btVector3 vertex;
          vertices->getVertex(i, vertex);
          offer(k++, vertex, mesh.getMargin());
        }
        vertices->unlockChildShapes();
      }
      return true;
    }
    case BOX_SHAPE_PROXYTYPE:
    case kHullType: {  // a box gives its exact corners, a hull its points, below their skin
      const auto& polyhedron = static_cast<const btPolyhedralConvexShape&>(shape);
      const double margin = shape.getShapeType() == BOX_SHAPE_PROXYTYPE ? 0 : polyhedron.getMargin();
      for (int k = 0; k < polyhedron.getNumVertices(); ++k) {
        btVector3 vertex;
        polyhedron.getVertex(k, vertex);
        offer(k, vertex, margin);
      }
      return true;
    }
    default:
      return false;
  }
}

}  // namespace crumple::sim::bullet
