#include "server/sim/bodies/solid_body.h"

#include "server/sim/rigid/proxy.h"

namespace crumple::sim {

Result<SolidBody> SolidBody::make(BodyId id, const BodyDescription& body, const RigidModel& model, RigidWorld& rigid,
                                  const std::string& field) {
  const auto tag = [&](const Error& e) { return std::unexpected(Error{e.code, field + "." + e.field, e.message}); };
  SolidBody solid{.id = id, .model = model};
  if (model.proxy) {
    solid.proxy = *model.proxy;
  } else if (auto proxy = proxy_tets(model.shapes)) {
    solid.proxy = std::move(*proxy);
  } else {
    return invalid(field + ".proxy", "is missing: shapes of triangles need tets that stand for them");
  }
  for (const PlacedShape& placed : model.shapes) {
    const auto* plane = std::get_if<Plane>(&placed.shape);
    if (!plane) continue;
    const Vec3 normal = (body.pose.R_WB * (placed.pose.R_WB * plane->normal.normalized())).normalized();
    const Vec3 on_plane = body.pose * (placed.pose * (plane->offset / plane->normal.norm() * plane->normal.normalized()));
    solid.planes.push_back({normal, normal.dot(on_plane), model.friction});
  }
  if (auto added = rigid.add_body(id, model, body.pose, body.velocity, body.angular_velocity); !added) return tag(added.error());
  if (!solid.proxy.tets.empty()) solid.collision = contact::make_collision_mesh(solid.proxy.tets, solid.proxy.X, {});
  solid.x.resize(solid.proxy.X.size());
  solid.follow(body.pose);
  return solid;
}

void SolidBody::follow(const Pose& X_WB) {
  for (std::size_t n = 0; n < x.size(); ++n) x[n] = X_WB * proxy.X[n];
}

BodyTopology SolidBody::topology(const BodyDescription& body, double plane_reach) const {
  BodyTopology drawn{.id = id, .name = body.name};
  drawn.model = model.kind == RigidKind::fixed ? BodyModel::fixed : BodyModel::rigid;
  drawn.colour = body.colour;
  drawn.opacity = body.opacity;
  const SurfaceMesh surface = model.render ? *model.render : draw_mesh(model.shapes, plane_reach);
  drawn.triangles = surface.triangles;
  for (const Vec3& v : surface.vertices) drawn.vertices.push_back(v.cast<float>());
  return drawn;
}

}  // namespace crumple::sim
