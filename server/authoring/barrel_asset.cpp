#include "server/authoring/barrel_asset.h"

#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

PoseField crushed_side(double R, double H) {
  return dent({.profile = Dent::Profile::flatten,
               .direction = -Vec3::UnitX(),
               .face = -R,
               .depth = 0.75 * R,
               .footprint = Vec3(1e9, 0.75 * H, 1e9),
               .swell = 0.18});
}

PoseField squashed(double R, double H) {
  return [=](const Vec3& X) -> Vec3 {
    const double u = 2 * X.y() / H, r = std::hypot(X.x(), X.z());
    const double belly = 0.16 * r * (1 - u * u);
    const Vec3 out = r > 0 ? Vec3(X.x() / r, 0, X.z() / r) : Vec3::Zero();
    return Vec3(0, -0.34 * X.y(), 0) + belly * out;
  };
}

PoseField crumpled(double R, double H) {
  return [=](const Vec3& X) -> Vec3 {
    const double u = 2 * X.y() / H, angle = std::atan2(X.z(), X.x());
    const double inwards = 0.34 * (1 + 0.45 * std::cos(3 * angle)) * (1 - 0.55 * u * u);
    return {-inwards * X.x(), -0.10 * X.y(), -inwards * X.z()};
  };
}

std::vector<Vec3> bones_on_side(const BarrelAsset& barrel) {
  std::vector<Vec3> out;
  for (int ring = 0; ring < barrel.bone_rings; ++ring)
    for (int k = 0; k < barrel.bones_a_ring; ++k) {
      const double u = barrel.bone_rings > 1 ? -1 + 2.0 * ring / (barrel.bone_rings - 1) : 0;
      const double r = barrel.shape.radius * (1 - barrel.shape.taper * u * u);
      const double angle = 2 * std::numbers::pi * k / barrel.bones_a_ring;
      out.push_back({r * std::cos(angle), u * barrel.shape.height / 2, r * std::sin(angle)});
    }
  return out;
}

}  // namespace

Result<sim::example_based::ExampleSet> make_barrel_asset(const BarrelAsset& barrel) {
  auto rig = make_rig(barrel_surface(barrel.shape), {.cell_size = barrel.cell_size},
                      [&](const sim::TetMesh&, const std::vector<int>&) { return bones_on_side(barrel); });
  if (!rig) return std::unexpected(rig.error());
  const double R = barrel.shape.radius + barrel.shape.hoop_depth, H = barrel.shape.height;
  add_example(*rig, "crushed_side", crushed_side(R, H));
  add_example(*rig, "squashed", squashed(R, H));
  add_example(*rig, "bent", kink({.angle = 0.9, .width = 0.3 * H, .pinch = 0.45 * R}), BoneRotations::follow_field);
  add_example(*rig, "crumpled", crumpled(R, H));
  rig->set.convex_parts = {rig->surface};
  if (auto valid = sim::example_based::validate(rig->set, "barrel"); !valid) return std::unexpected(valid.error());
  return std::move(rig->set);
}

}  // namespace crumple::authoring
