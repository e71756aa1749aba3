#include "server/rig/broken_scene.h"

#include "common/text.h"
#include "server/io/message_json.h"
#include "server/rig/scene_messages.h"
#include "server/scene_convert/geometry_convert.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crumple::rig {
namespace {

double speed_of_ball(double size) { return 12 * std::sqrt(size); }  // [m/s]

struct Whole {
  Eigen::AlignedBox3d box;
  double foot = std::numeric_limits<double>::infinity();  // height of the lowest point that collides [m]
  double volume = 0;                                      // [m^3]
  double size = 0;                                        // longest side [m]
};

Whole whole_of(const authoring::PrescoredAsset& asset) {
  Whole out;
  for (const auto& part : asset.parts) {
    for (const Vec3& X : part.set.mesh.X) out.box.extend(X);
    for (const auto& hull : part.set.convex_parts)
      for (const int v : hull) out.foot = std::min(out.foot, part.set.mesh.X[v].y());
    out.volume += part.volume;
  }
  out.size = out.box.sizes().maxCoeff();
  return out;
}

// Of the joints. Crumbs count as a tenth of the mean: alone they would give way to the least load, while the parts
// still lie in each other's way.
std::vector<double> bearing_areas(const std::vector<authoring::PrescoredFace>& faces) {
  double mean = 0;
  for (const auto& face : faces) mean += face.area / static_cast<double>(faces.size());
  std::vector<double> out;
  for (const auto& face : faces) out.push_back(std::max(face.area, 0.1 * mean));
  return out;
}

// A ball of half the asset's mass into its upper half, at a speed in proportion to the square root of its size.
void add_ball(v1::Scene& scene, const Whole& whole, double mass, const Vec3& foot) {
  const double radius = 0.12 * whole.size, speed = speed_of_ball(whole.size);
  const Vec3 target = whole.box.center() - foot;
  const Vec3 start(whole.box.min().x() - foot.x() - 1.5 * whole.size,
                   std::max(target.y() + 0.15 * whole.box.sizes().y(), 1.05 * radius), target.z());
  v1::Body& ball = add_body(scene, "ball", start, {0.5f, 0.1f, 0.05f});
  // It drops by g t^2 / 2 on its way.
  const double time = 1.5 * whole.size / speed;
  *ball.mutable_velocity() = scene_convert::to_message(Vec3(speed, kGravity * time / 2, 0));
  v1::RigidBody& rigid = *ball.mutable_rigid();
  rigid.set_mass(mass / 2);
  rigid.add_shapes()->mutable_sphere()->set_radius(radius);
}

}  // namespace

std::array<float, 3> part_colour(std::size_t part) {
  // Hues a golden section apart: neighbours in the list differ, and no hue comes twice.
  const double hue = std::fmod(0.61803398875 * static_cast<double>(part) + 0.58, 1.0);
  std::array<float, 3> out{};
  for (int k = 0; k < 3; ++k) {
    const double away = std::abs(std::fmod(hue + k / 3.0, 1.0) - 0.5);  // 0 to 0.5
    out[k] = static_cast<float>(0.1 + 0.42 * std::clamp(3 * away - 0.25, 0.0, 1.0));
  }
  return out;
}

double default_strength(const authoring::PrescoredAsset& asset, double density) {
  return 100 * density * kGravity * whole_of(asset).size;
}

Result<std::string> broken_scene(const authoring::PrescoredAsset& asset, const std::vector<std::string>& files,
                                 const std::string& name, const BrokenSceneOptions& o) {
  if (!(o.strength >= 0 && o.strength <= 1e15))
    return invalid("strength", text("is ", o.strength, " Pa, must be in (0, 1e15]"));
  if (!(o.density > 0 && o.density <= 1e6))
    return invalid("density", text("is ", o.density, " kg/m^3, must be in (0, 1e6]"));
  const Whole whole = whole_of(asset);
  const double strength = o.strength > 0 ? o.strength : default_strength(asset, o.density);
  const Vec3 foot(whole.box.center().x(), whole.foot, whole.box.center().z());

  v1::Scene scene;
  scene.set_name(name);
  scene.set_description(text(asset.parts.size(), " parts, held together where their faces meet."));
  scene.set_dt(1.0 / 240);
  add_ground(scene);
  for (std::size_t p = 0; p < asset.parts.size(); ++p) {
    v1::Body& body = add_body(scene, text("part ", p + 1), -foot, part_colour(p));
    body.set_asleep(true);  // it stands as it was cut until something touches it
    v1::ExampleBody& example = *body.mutable_example();
    example.mutable_asset()->set_file(files[p]);
    example.set_mass(o.density * asset.parts[p].volume);
    set_parameters(example, whole.size, o.density * whole.volume, speed_of_ball(whole.size));
  }
  const std::vector<double> areas = bearing_areas(asset.faces);
  for (std::size_t f = 0; f < asset.faces.size(); ++f) {
    const auto& face = asset.faces[f];
    v1::Joint& joint = *scene.add_joints();
    joint.set_a(text("part ", face.a + 1));
    joint.set_b(text("part ", face.b + 1));
    *joint.mutable_position() = scene_convert::to_message(face.centroid - foot);
    joint.set_strength(strength * areas[f]);
    joint.set_bending(strength * std::pow(areas[f], 1.5) / 6);
  }
  if (o.struck) add_ball(scene, whole, o.density * whole.volume, foot);
  return io::print_json(scene);
}

}  // namespace crumple::rig
