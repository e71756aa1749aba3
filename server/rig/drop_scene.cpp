#include "server/rig/drop_scene.h"

#include "common/text.h"
#include "server/io/message_json.h"
#include "server/io/side_files.h"
#include "server/rig/scene_messages.h"
#include "server/scene_convert/geometry_convert.h"

#include <cmath>

namespace crumple::rig {
namespace {

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.parent_path().empty() ? "." : file.parent_path();
}

}  // namespace

Result<void> scene_can_name(const std::filesystem::path& asset, const std::filesystem::path& scene_file) {
  if (io::lies_inside(asset, folder_of(scene_file))) return {};
  return invalid("--scene",
                 text("is ", scene_file.string(), ", but ", asset.string(), " must lie in its folder or below it"));
}

Result<std::string> drop_scene(const sim::example_based::ExampleSet& set, const std::filesystem::path& asset,
                               const std::filesystem::path& scene_file) {
  if (auto valid = scene_can_name(asset, scene_file); !valid) return std::unexpected(valid.error());
  const std::filesystem::path folder = folder_of(scene_file);
  std::error_code failure;
  const std::filesystem::path name = std::filesystem::proximate(
      std::filesystem::weakly_canonical(asset, failure), std::filesystem::weakly_canonical(folder, failure), failure);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : set.mesh.X) box.extend(p);
  double volume = 0;
  for (int t = 0; t < set.mesh.tet_count(); ++t) volume += sim::signed_volume(set.mesh, t);
  const double size = box.sizes().maxCoeff(), mass = kAssetDensity * volume, drop = 1.5 * size;

  v1::Scene scene;
  scene.set_name(scene_file.stem().string());
  scene.set_description(text("Drops ", name.string(), "."));
  scene.set_dt(1.0 / 240);
  add_ground(scene);
  const Vec3 half(0.3 * size, 0.2 * size, 0.8 * size);
  v1::RigidBody& block = *add_body(scene, "block", {-0.35 * size, half.y(), 0}, {0.55f, 0.54f, 0.5f}).mutable_rigid();
  block.set_kind(v1::RigidBody::FIXED);
  *block.add_shapes()->mutable_box()->mutable_half_extents() = scene_convert::to_message(half);

  const Quat tilt(Eigen::AngleAxisd(0.5, Vec3(0.3, 0, 1).normalized()));
  v1::Body& body = add_body(scene, "dropped", Vec3(0, 2 * half.y() + drop + 0.5 * size, 0) - tilt * box.center(),
                            {0.13f, 0.3f, 0.55f});
  *body.mutable_pose()->mutable_quaternion() = scene_convert::to_message(tilt);
  v1::ExampleBody& example = *body.mutable_example();
  example.mutable_asset()->set_file(name.generic_string());
  example.set_mass(mass);
  set_parameters(example, size, mass, std::sqrt(2 * kGravity * drop));
  return io::print_json(scene);
}

}  // namespace crumple::rig
