#include "server/scene_convert/rigid_convert.h"

#include "server/authoring/enclosing_mesh.h"
#include "server/scene_convert/generated_shape.h"
#include "server/scene_convert/geometry_convert.h"
#include "server/scene_convert/motion_convert.h"
#include "server/scene_convert/surface_convert.h"

namespace crumple::scene_convert {
namespace {

constexpr int kDefaultProxyTets = 2'000;

sim::RigidKind to_kind(int kind, const std::string& field, Conversion& c) {
  switch (kind) {
    case v1::RigidBody::DYNAMIC:
      return sim::RigidKind::dynamic;
    case v1::RigidBody::FIXED:
      return sim::RigidKind::fixed;
    case v1::RigidBody::KINEMATIC:
      return sim::RigidKind::kinematic;
    default:
      c.breach.require(false, field, "is " + std::to_string(kind) + ", must be DYNAMIC, FIXED or KINEMATIC");
  }
  return {};
}

sim::Shape to_box(const v1::Box& message) {
  return sim::Box{to_vec3(message.has_half_extents(), message.half_extents(), sim::Box().half_extents)};
}

sim::Shape to_sphere(const v1::Sphere& message) {
  sim::Sphere sphere;
  if (message.has_radius()) sphere.radius = message.radius();
  return sphere;
}

sim::Shape to_cylinder(const v1::Cylinder& message) {
  sim::Cylinder cylinder;
  if (message.has_radius()) cylinder.radius = message.radius();
  if (message.has_half_length()) cylinder.half_length = message.half_length();
  return cylinder;
}

sim::Shape to_plane(const v1::Plane& message) {
  sim::Plane plane;
  plane.normal = to_vec3(message.has_normal(), message.normal(), plane.normal);
  if (message.has_offset()) plane.offset = message.offset();
  return plane;
}

sim::Shape to_hull(const v1::ConvexHull& message, const std::string& field, Conversion& c) {
  sim::ConvexHull hull;
  for (const v1::Vec3& point : message.points()) hull.points.push_back(to_vec3(point));
  if (message.has_surface()) {
    c.breach.require(hull.points.empty(), field + ".surface", "is given beside points, must be given alone");
    if (const auto surface = to_shared_surface(message.surface(), field + ".surface", c); c.breach.ok())
      hull.points = surface->vertices;
  }
  return hull;
}

sim::Shape to_triangles(const v1::TriangleShape& message, const std::string& field, Conversion& c) {
  const auto surface = to_shared_surface(message.mesh(), field + ".mesh", c);
  return surface ? sim::TriangleShape{*surface} : sim::TriangleShape{};
}

sim::Shape to_shape(const v1::Shape& message, const std::string& field, Conversion& c) {
  switch (message.shape_case()) {
    case v1::Shape::kBox:
      return to_box(message.box());
    case v1::Shape::kSphere:
      return to_sphere(message.sphere());
    case v1::Shape::kCylinder:
      return to_cylinder(message.cylinder());
    case v1::Shape::kPlane:
      return to_plane(message.plane());
    case v1::Shape::kConvexHull:
      return to_hull(message.convex_hull(), field + ".convex_hull", c);
    case v1::Shape::kTriangles:
      return to_triangles(message.triangles(), field + ".triangles", c);
    case v1::Shape::SHAPE_NOT_SET:
      break;
  }
  c.breach.require(false, field, "has no shape, must be one of box, sphere, cylinder, plane, convex_hull, triangles");
  return sim::Box();
}

// Every triangle of the body, in its axes.
sim::SurfaceMesh merged_triangles(const sim::RigidModel& model) {
  sim::SurfaceMesh merged;
  for (const sim::PlacedShape& placed : model.shapes) {
    const auto* shape = std::get_if<sim::TriangleShape>(&placed.shape);
    if (!shape) continue;
    const int first = static_cast<int>(merged.vertices.size());
    for (const Vec3& p : shape->mesh.vertices) merged.vertices.push_back(placed.pose * p);
    for (const Triangle& t : shape->mesh.triangles)
      merged.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return merged;
}

std::shared_ptr<const sim::TetMesh> make_proxy(const sim::RigidModel& model, int budget, const std::string& field,
                                               Conversion& c) {
  auto enclosing = authoring::enclosing_mesh(merged_triangles(model), {.tet_budget = budget});
  auto made = c.value(std::move(enclosing), field);
  return std::make_shared<const sim::TetMesh>(std::move(made.mesh));
}

void add_shapes(const v1::RigidBody& message, sim::RigidModel& model, const std::string& field, Conversion& c) {
  c.breach.count(static_cast<std::size_t>(message.shapes_size()), 1, sim::limits::kMaxShapes, field);
  int triangles = 0;
  for (int i = 0; c.breach.ok() && i < message.shapes_size(); ++i) {
    const std::string path = entry(field, i);
    sim::PlacedShape placed;
    placed.pose = c.value(to_pose(message.shapes(i).pose(), path + ".pose"), "");
    placed.shape = to_shape(message.shapes(i), path, c);
    triangles += message.shapes(i).has_triangles();
    c.breach.require(triangles == 0 || triangles == i + 1, path,
                     "mixes triangles with other shapes, must be of one kind");
    model.shapes.push_back(std::move(placed));
  }
}

}  // namespace

sim::RigidModel to_rigid(const v1::RigidBody& message, const std::string& field, Conversion& c) {
  sim::RigidModel model;
  model.kind = to_kind(message.kind(), field + ".kind", c);
  if (message.has_density()) model.density = message.density();
  if (message.has_mass()) model.mass = message.mass();
  if (message.has_friction()) model.friction = message.friction();
  if (message.has_restitution()) model.restitution = message.restitution();
  add_shapes(message, model, field + ".shapes", c);
  model.motion = to_keys(message.motion(), field + ".motion", c);
  if (message.has_render()) model.render = to_shared_surface(message.render(), field + ".render", c);
  const double budget =
      number_or(message.has_proxy_tets(), message.proxy_tets(), kDefaultProxyTets, {1, 1e5}, field + ".proxy_tets", c);
  if (c.breach.ok() && message.shapes(0).has_triangles())
    model.proxy = make_proxy(model, static_cast<int>(budget), field + ".shapes", c);
  return model;
}

}  // namespace crumple::scene_convert
