#include "server/scene_convert/surface_convert.h"

#include "server/authoring/shapes/surfaces.h"
#include "server/scene_convert/asset_convert.h"
#include "server/scene_convert/generated_shape.h"
#include "server/scene_convert/geometry_convert.h"

namespace crumple::scene_convert {
namespace {

constexpr sim::Range kSize{1e-4, 1e4};   // of generated shapes [m]
constexpr sim::Range kScale{1e-6, 1e6};  // [-]
constexpr int kSphereLevels = 3;         // 1,280 triangles

sim::SurfaceMesh make_box(const v1::BoxSurface& message, const std::string& field, Conversion& c) {
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  const Vec3 size = to_vec3(message.has_size(), message.size(), Vec3::Ones());
  for (int i = 0; i < 3; ++i) c.breach.number(size[i], kSize, field + ".size" + kAxes[i]);
  return c.breach.ok() ? authoring::box_surface(size / 2) : sim::SurfaceMesh();
}

sim::SurfaceMesh make_sphere(const v1::SphereSurface& message, const std::string& field, Conversion& c) {
  const double radius = number_or(message.has_radius(), message.radius(), 0.5, kSize, field + ".radius", c);
  return c.breach.ok() ? authoring::icosphere(radius, kSphereLevels) : sim::SurfaceMesh();
}

sim::SurfaceMesh make_barrel(const v1::BarrelShape& message, const std::string& field, Conversion& c) {
  const authoring::BarrelShape shape = to_barrel(message, field, c);
  return c.breach.ok() ? authoring::barrel_surface(shape) : sim::SurfaceMesh();
}

sim::SurfaceMesh make_car(const v1::CarShape& message, const std::string& field, Conversion& c) {
  const authoring::CarShape shape = to_car(message, field, c);
  return c.breach.ok() ? authoring::car_surface(shape).whole() : sim::SurfaceMesh();
}

sim::SurfaceMesh make_loft(const v1::LoftSurface& message, const std::string& field, Conversion& c) {
  const std::vector<authoring::Loft> lofts = to_lofts(message, field, c);
  sim::SurfaceMesh surface;
  if (!c.breach.ok()) return surface;
  for (const authoring::Loft& loft : lofts) authoring::append(surface, authoring::loft_surface(loft));
  return surface;
}

sim::SurfaceMesh make_surface(const v1::SurfaceSource& message, const std::string& field, Conversion& c) {
  using Source = v1::SurfaceSource;
  switch (message.source_case()) {
    case Source::kFile:
      return c.value(c.files.surface(message.file()), field + ".file");
    case Source::kInlineMesh:
      return c.value(to_surface_mesh(message.inline_mesh(), field + ".inline_mesh"), "");
    case Source::kBox:
      return make_box(message.box(), field + ".box", c);
    case Source::kSphere:
      return make_sphere(message.sphere(), field + ".sphere", c);
    case Source::kBarrel:
      return make_barrel(message.barrel(), field + ".barrel", c);
    case Source::kCar:
      return make_car(message.car(), field + ".car", c);
    case Source::kLoft:
      return make_loft(message.loft(), field + ".loft", c);
    case Source::SOURCE_NOT_SET:
      break;
  }
  c.breach.require(false, field, "has no source, must be one of file, inline_mesh, box, sphere, barrel, car, loft");
  return {};
}

}  // namespace

std::shared_ptr<const sim::SurfaceMesh> to_shared_surface(const v1::SurfaceSource& message, const std::string& field,
                                                          Conversion& c) {
  if (!c.breach.ok()) return nullptr;
  std::shared_ptr<const sim::SurfaceMesh>& shared = c.surfaces[message.SerializeAsString()];
  if (shared) return shared;
  const double scale = number_or(message.has_scale(), message.scale(), 1, kScale, field + ".scale", c);
  sim::SurfaceMesh mesh = make_surface(message, field, c);
  if (!c.breach.ok()) return nullptr;
  for (Vec3& p : mesh.vertices) p *= scale;
  return shared = std::make_shared<const sim::SurfaceMesh>(std::move(mesh));
}

}  // namespace crumple::scene_convert
