#include "server/lab/destruction_scenes.h"

#include "common/text.h"
#include "server/authoring/barrel_asset.h"
#include "server/authoring/car_asset.h"
#include "server/lab/scene_builder.h"
#include "server/lab/spacecraft_scenes.h"

#include <cmath>
#include <memory>

namespace crumple::lab {
namespace {

using sim::BodyDescription;
using sim::RigidKind;
using sim::SceneDescription;
using sim::example_based::ExampleSet;

constexpr double kBarrelMass = 215.9;  // [kg]

// Theirs: N 1790, 8,238 tets, B 12, E 3, .66 x .76 x .66 m, no example with a rotation.
SharedSet barrel_set(const authoring::BarrelShape& shape, double cell_size) {
  ExampleSet set = *authoring::make_barrel_asset({.shape = shape, .cell_size = cell_size, .bone_rings = 3, .bones_a_ring = 4});
  std::erase_if(set.examples, [](const auto& e) { return e.name != "rest" && e.name != "crushed_side" && e.name != "crumpled"; });
  return std::make_shared<const ExampleSet>(std::move(set));
}

SharedSet paper_barrel() { return barrel_set({.height = 0.76}, 0.0755); }

// Theirs: N 1578, 6,762 tets, B 32, E 6; and N 3598, 16,662 tets, B 48, E 7; 2.12 x 1.73 x 5.51 m.
SharedSet paper_car(bool large) {
  authoring::CarAsset car{.shape = {.length = 5.51, .width = 2.12, .height = 1.73}, .cell_size = large ? 0.223 : 0.305};
  if (large) {
    car.bones = 48;
    car.flattened = true;
  }
  return std::make_shared<const ExampleSet>(*authoring::make_car_asset(car));
}

SceneDescription dock(const DestructionOptions& options) {
  SceneBuilder b("dock", 0.00412, options.seed);
  b.dock();
  const SharedSet barrel = paper_barrel();
  const Vec3 places[] = {{0, 3, 0}, {0.3, 4.1, 0.35}, {-0.2, 5, -0.4}};
  for (int k = 0; k < 3; ++k)
    b.example(text("barrel ", k), barrel, kBarrelMass, places[k], {.alpha = 48, .beta = 21, .gamma = 0.667, .lambda = 0.95});
  return std::move(b.scene);
}

SceneDescription pachinko(const DestructionOptions& options) {
  SceneBuilder b("pachinko", 0.004, options.seed);
  b.ground();
  b.scene.bodies.push_back(plane_body("back", Vec3::UnitZ(), -1, 0.5));
  b.scene.bodies.push_back(plane_body("front", -Vec3::UnitZ(), -1, 0.5));
  const Quat along_z = Quat::FromTwoVectors(Vec3::UnitY(), Vec3::UnitZ());
  for (int row = 0; row < 20; ++row) {
    const int count = 7 + row % 2;
    for (int k = 0; k < count; ++k) {
      BodyDescription pipe = solid_body(text("pipe ", row, " ", k), sim::Cylinder{0.12, 1}, RigidKind::fixed,
                                        {1.75 * (k - (count - 1) / 2.0), 18 - 0.875 * row, 0});
      pipe.pose.R_WB = along_z;
      b.scene.bodies.push_back(pipe);
    }
  }
  const SharedSet barrel = paper_barrel();
  for (int level = 0; level < 5; ++level)
    for (int k = 0; k < 7; ++k) {
      const Vec3 place(-4.2 + 1.4 * k, 20 + level, 0);
      b.example(text("barrel ", 7 * level + k), barrel, kBarrelMass, place, {.alpha = 28, .beta = 27, .gamma = 0.4, .lambda = 0.95})
          .pose.R_WB = b.any_turn();
    }
  return std::move(b.scene);
}

// Theirs is held at its speed for .75 s; ours has it from the start and little friction in place of wheels that turn.
SceneDescription driver(const DestructionOptions& options) {
  SceneBuilder b("driver", 0.005, options.seed);
  b.scene.rigid_iterations = 10;  // as Bullet's own; a pyramid of four barrels needs no more
  b.dock();
  const Vec3 v(7.4, 0, -7.5);
  BodyDescription& car = b.example("car", paper_car(false), 4369, {-8, 0.01, 9}, {.alpha = 250, .beta = 102, .gamma = 1, .lambda = 0.7});
  car.pose.R_WB = about(Vec3::UnitY(), std::atan2(-v.z(), v.x()));
  car.velocity = v;
  std::get<sim::ExampleModel>(car.model).friction = 0.05;
  const SharedSet barrel = paper_barrel();
  int id = 0;
  for (int level = 0; level < 4; ++level)
    for (int i = 0; i < 4 - level; ++i)
      for (int k = 0; k < 4 - level; ++k) {
        const double middle = (3 - level) / 2.0;
        const Vec3 place(-1.5 + 0.68 * (i - middle), 0.382 + 0.77 * level, 2.4 + 0.68 * (k - middle));
        b.example(text("barrel ", id++), barrel, kBarrelMass, place, {.alpha = 100, .beta = 389, .gamma = 0.5, .lambda = 0.7});
      }
  return std::move(b.scene);
}

SceneDescription pileup(const DestructionOptions& options) {
  SceneBuilder b("pileup", 0.004, options.seed);
  b.ground();
  const SharedSet set = paper_car(true);
  int id = 0;
  for (const double side : {-1.0, 1.0}) {
    b.fixed_box(text("ramp ", side), {7, 3, 5}, {0, -1.2, 12 * side}, about(Vec3::UnitX(), side * 20 * M_PI / 180));
    for (const double z : {30, 50, 70, 90}) {
      BodyDescription& car = b.example(text("car ", id++), set, 56861, {0.3 * side, 0.01, side * z},
                                       {.alpha = 75, .beta = 85292, .gamma = 3.33, .lambda = 0.975, .restitution = 0.5});
      car.pose.R_WB = about(Vec3::UnitY(), side * M_PI / 2);  // towards the middle
      car.velocity = {0, 0, -35 * side};
      std::get<sim::ExampleModel>(car.model).friction = 0.05;
    }
  }
  return std::move(b.scene);
}

SceneDescription cannonballs(const DestructionOptions& options) {
  SceneBuilder b("cannonballs", 0.004, options.seed);
  b.ground();
  const sim::example_based::ExampleParameters metal{.alpha = 100, .gamma = 3.33, .lambda = 0.8, .restitution = 0.25};
  b.example("car", paper_car(true), 4369, {0, 0.01, 0}, metal);
  authoring::CarAsset larger{.shape = {.length = 1.5 * 5.51, .width = 1.5 * 2.12, .height = 1.5 * 1.73}, .cell_size = 1.5 * 0.223, .bones = 48};
  larger.flattened = true;
  b.example("second car", std::make_shared<const ExampleSet>(*authoring::make_car_asset(larger)), 4369 * 3.375, {0.4, 200, 0.3}, metal);
  for (int k = 0; k < 8; ++k) {  // one after the other, from all round, each at its own height on the car
    const double angle = 2.4 * k + 0.4, speed = 42 + 18.0 * k / 7, arrival = 0.3 + 0.45 * k;
    const Vec3 from(std::cos(angle), 0, std::sin(angle)), aim(1.2 * std::cos(3.1 * k), 0.6 + 0.08 * k, 0);
    BodyDescription ball = solid_body(text("ball ", k), sim::Sphere{0.3}, RigidKind::dynamic,
                                      aim + speed * arrival * from + Vec3(0, 4.905 * arrival * arrival, 0));
    ball.velocity = -speed * from;
    std::get<sim::RigidModel>(ball.model).mass = 600 + 400.0 * k / 7;
    b.scene.bodies.push_back(ball);
  }
  return std::move(b.scene);
}

SceneDescription pegs(const DestructionOptions& options) {
  SceneBuilder b("pegs", 0.004, options.seed);
  authoring::BarrelShape shape = authoring::plain_barrel();
  const SharedSet barrel = barrel_set(shape, 0.0755);
  for (int l = 0; l < 5; ++l)
    for (int c = 0; c < 10; ++c) {
      const double z = b.uniform(-1, 1);
      b.example(text("barrel ", 10 * l + c), barrel, 20, {1.1 * (c - 4.5), 8.2 + 1.15 * l, z},
                {.alpha = 28, .beta = 10, .gamma = 0.4, .lambda = 0.95}).pose.R_WB = b.any_turn();
    }
  const Quat along_z = Quat::FromTwoVectors(Vec3::UnitY(), Vec3::UnitZ());
  for (int r = 0; r < 5; ++r)
    for (int c = -4; c <= 4; ++c) {
      BodyDescription peg = solid_body(text("peg ", r, " ", c), sim::Cylinder{0.12, 2}, RigidKind::fixed,
                                       {1.2 * c + 0.6 * (r % 2), 1.5 + 1.2 * r, 0});
      peg.pose.R_WB = along_z;
      b.scene.bodies.push_back(peg);
    }
  b.ground();
  for (const double side : {-1.0, 1.0}) {
    b.fixed_box(text("wall z ", side), {6, 20, 0.2}, {0, 20, 2.2 * side});
    b.fixed_box(text("wall x ", side), {0.2, 20, 2.4}, {6 * side, 20, 0});
  }
  return std::move(b.scene);
}

}  // namespace

Result<SceneDescription> destruction_scene(const std::string& name, const DestructionOptions& options) {
  if (name == "dock") return dock(options);
  if (name == "pachinko") return pachinko(options);
  if (name == "driver") return driver(options);
  if (name == "pileup") return pileup(options);
  if (name == "cannonballs") return cannonballs(options);
  if (name == "pegs") return pegs(options);
  if (name == "space") return space(options.seed);
  if (name == "shipyard") return shipyard(options.seed);
  return invalid("scene", "is " + name + ", must be dock, pachinko, driver, pileup, cannonballs, pegs, space or shipyard");
}

const std::map<std::string, int>& destruction_steps() {
  static const std::map<std::string, int> kSteps{{"dock", 600},         {"pachinko", 1500}, {"driver", 400},    {"pileup", 1250},
                                                 {"cannonballs", 1750}, {"space", 971},     {"shipyard", 1920}, {"pegs", 1000}};
  return kSteps;
}

}  // namespace crumple::lab
