#include "server/lab/vertex_depth.h"

#include "server/authoring/surface_distance.h"
#include "server/sim/mesh/tet_tree.h"

#include <algorithm>
#include <memory>
#include <optional>

namespace crumple::lab {
namespace {

// A body where it is now.
struct Placed {
  sim::TetMesh mesh;
  Eigen::AlignedBox3d box;
  std::optional<sim::TetTree> tets;
  std::optional<authoring::SurfaceDistance> surface;

  explicit Placed(const sim::FemView& view) {
    mesh.X = view.x;
    mesh.tets = view.tets;
    for (const Vec3& p : mesh.X) box.extend(p);
  }
  double depth(const Vec3& p) {
    if (!box.contains(p)) return 0;
    if (!tets) tets.emplace(mesh);
    if (tets->nearest(p).squared_distance > 0) return 0;
    if (!surface) surface.emplace(exterior());
    return (*surface)(p);
  }

 private:
  sim::SurfaceMesh exterior() const {
    sim::SurfaceMesh shell{mesh.X, {}};
    for (const sim::SurfaceFace& face : sim::surface_faces(mesh.tets)) shell.triangles.push_back(face.nodes);
    return shell;
  }
};

double below_planes(const Vec3& p, const sim::SceneDescription& scene) {
  double depth = 0;
  for (const sim::BodyDescription& body : scene.bodies) {
    const auto* rigid = std::get_if<sim::RigidModel>(&body.model);
    if (rigid == nullptr || rigid->kind != sim::RigidKind::fixed) continue;
    for (const sim::PlacedShape& placed : rigid->shapes) {
      const auto* plane = std::get_if<sim::Plane>(&placed.shape);
      if (plane == nullptr) continue;
      const Vec3 n = body.pose.R_WB * (placed.pose.R_WB * plane->normal.normalized());
      depth = std::max(depth, plane->offset - n.dot(p - body.pose * placed.pose.p_WB));
    }
  }
  return depth;
}

}  // namespace

double vertex_depth(const sim::World& world, const sim::SceneDescription& scene) {
  std::vector<std::unique_ptr<Placed>> bodies;  // trees refer to the mesh beside them
  for (BodyId id = 0; id < scene.bodies.size(); ++id) {
    if (std::holds_alternative<sim::FemModel>(scene.bodies[id].model)) bodies.push_back(std::make_unique<Placed>(world.fem(id)));
  }
  double deepest = 0;
  for (const auto& body : bodies) {
    for (const Vec3& p : body->mesh.X) deepest = std::max(deepest, below_planes(p, scene));
    for (const auto& other : bodies) {
      if (other == body || !other->box.intersects(body->box)) continue;
      for (const Vec3& p : body->mesh.X) deepest = std::max(deepest, other->depth(p));
    }
  }
  return deepest;
}

}  // namespace crumple::lab
