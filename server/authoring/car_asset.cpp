#include "server/authoring/car_asset.h"

#include "server/authoring/convex_parts.h"
#include "server/authoring/handle_placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

// A bump [m] that rises in the middle of [from, to] along x, for points above `floor`: buckling bonnets and boots.
PoseField buckle(double from, double to, double floor, double rise) {
  return [=](const Vec3& X) -> Vec3 {
    const double s = (X.x() - from) / (to - from);
    if (s <= 0 || s >= 1) return Vec3::Zero();
    const double above = std::clamp((X.y() - floor) / (0.4 * floor), 0.0, 1.0);
    return {0, rise * above * std::pow(std::sin(std::numbers::pi * s), 2), 0};
  };
}

PoseField crushed_front(const CarShape& s) {
  const Dent push{.direction = -Vec3::UnitX(),
                  .face = -s.length / 2,
                  .depth = 0.20 * s.length,
                  .zone = 0.46 * s.length,
                  .centre = Vec3(0, 0.4 * s.height, 0),
                  .swell = 0.06};
  return sum(dent(push), buckle(0.18 * s.length, 0.5 * s.length, 0.45 * s.height, 0.16 * s.height));
}

PoseField crushed_rear(const CarShape& s) {
  const Dent push{.direction = Vec3::UnitX(),
                  .face = -s.length / 2,
                  .depth = 0.17 * s.length,
                  .zone = 0.42 * s.length,
                  .centre = Vec3(0, 0.4 * s.height, 0),
                  .swell = 0.06};
  return sum(dent(push), buckle(-0.5 * s.length, -0.22 * s.length, 0.5 * s.height, 0.13 * s.height));
}

PoseField dented_side(const CarShape& s, double side) {
  return dent({.direction = Vec3(0, 0, -side),
               .face = -s.width / 2,
               .depth = 0.30 * s.width,
               .zone = 0.8 * s.width,
               .centre = Vec3(0.02 * s.length, 0.5 * s.height, 0),
               .footprint = Vec3(0.27 * s.length, 1.0 * s.height, 1e9)});
}

PoseField roof_flattened(const CarShape& s) {
  return dent({.direction = -Vec3::UnitY(),
               .face = -s.height,
               .depth = 0.30 * s.height,
               .zone = 0.62 * s.height,
               .centre = Vec3(-0.1 * s.length, 0, 0),
               .footprint = Vec3(0.42 * s.length, 1e9, 1e9),
               .swell = 0.10});
}

// Pressed to the ground: height to two fifths, and broader by a tenth.
PoseField flattened() {
  return [](const Vec3& X) -> Vec3 { return {0.05 * X.x(), -0.6 * X.y(), 0.1 * X.z()}; };
}

bool in_wheel(const CarSurface& car, int wheel, const Vec3& X, double slack) {
  const Vec3 reach(car.wheel_radius, car.wheel_radius, car.wheel_width / 2);
  return ((X - car.wheel_centres[wheel]).cwiseAbs().array() <= (reach.array() + slack)).all();
}

// A hub each and the rest by place_handles: a wheel with bones on its tread would be drawn out of shape.
std::vector<Vec3> place_bones(const CarSurface& car, int count, const sim::TetMesh& mesh,
                              const std::vector<int>& surface) {
  std::vector<int> body;
  for (const int node : surface) {
    bool wheel = false;
    for (int k = 0; k < 4; ++k) wheel = wheel || in_wheel(car, k, mesh.X[node], 0.1 * car.wheel_radius);
    if (!wheel) body.push_back(node);
  }
  std::vector<Vec3> bones(car.wheel_centres.begin(), car.wheel_centres.end());
  for (const Vec3& p : points_of(mesh, place_handles(mesh, body, std::max(count - 4, 1)))) bones.push_back(p);
  return bones;
}

// The same field, but each wheel moves as its hub does.
PoseField with_stiff_wheels(const CarSurface& car, PoseField field) {
  return [car, field = std::move(field)](const Vec3& X) -> Vec3 {
    for (int k = 0; k < 4; ++k)
      if (in_wheel(car, k, X, 0)) return field(car.wheel_centres[k]);
    return field(X);
  };
}

void add_convex_parts(Rig& rig, const CarSurface& surface, const CarShape& s) {
  const auto add = [&](const Vec3& lower, const Vec3& upper) {
    auto part = hull_part_in_box(rig.set.mesh.X, rig.surface, lower, upper);
    if (!part.empty()) rig.set.convex_parts.push_back(std::move(part));
  };
  const double far = 2 * s.length, h = rig.report.cell_size, belt = surface.belt_height + 0.3 * h;
  const double sill = 0.16 * s.height;  // below it there are only wheels
  add({0.2 * s.length - h / 2, sill, -far}, {far, belt, far});
  add({-0.2 * s.length - h / 2, sill, -far}, {0.2 * s.length + h / 2, belt, far});
  add({-far, sill, -far}, {-0.2 * s.length + h / 2, belt, far});
  add({-far, surface.belt_height - 0.3 * h, -far}, {0.26 * s.length, far, far});
  for (const Vec3& centre : surface.wheel_centres) {
    const Vec3 reach(surface.wheel_radius, surface.wheel_radius, surface.wheel_width / 2);
    const Vec3 slack = Vec3::Constant(0.05 * h);
    add(centre - reach - slack, centre + reach + slack);
  }
}

}  // namespace

Result<sim::example_based::ExampleSet> make_car_asset(const CarAsset& car) {
  const CarSurface surface = car_surface(car.shape);
  auto rig = make_rig(surface.whole(), {.cell_size = car.cell_size},
                      [&](const sim::TetMesh& mesh, const std::vector<int>& nodes) {
                        return place_bones(surface, car.bones, mesh, nodes);
                      });
  if (!rig) return std::unexpected(rig.error());
  const auto add = [&](const char* name, PoseField field) {
    add_example(*rig, name, with_stiff_wheels(surface, std::move(field)));
  };
  add("crushed_front", crushed_front(car.shape));
  add("crushed_rear", crushed_rear(car.shape));
  add("dented_left", dented_side(car.shape, -1));
  add("dented_right", dented_side(car.shape, 1));
  add("roof_flattened", roof_flattened(car.shape));
  if (car.flattened) add_example(*rig, "flattened", flattened());  // wheels too: they go flat, or would reach below the ground
  add_convex_parts(*rig, surface, car.shape);
  if (auto valid = sim::example_based::validate(rig->set, "car"); !valid) return std::unexpected(valid.error());
  return std::move(rig->set);
}

}  // namespace crumple::authoring
