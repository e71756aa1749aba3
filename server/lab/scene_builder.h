#pragma once

#include "server/lab/scene_bodies.h"

#include <cmath>
#include <memory>
#include <random>

namespace crumple::lab {

using SharedSet = std::shared_ptr<const sim::example_based::ExampleSet>;

inline Quat about(const Vec3& axis, double angle) { return Quat(Eigen::AngleAxisd(angle, axis)); }

// Puts the benchmark scenes of example-based bodies together.
class SceneBuilder {
 public:
  SceneBuilder(const std::string& name, double dt, std::uint64_t seed)
      : scene{.name = name, .dt = dt, .sleep = kNeverSleeps}, random_(seed) {}

  void fixed_box(const std::string& name, const Vec3& half_extents, const Vec3& centre, const Quat& turn = Quat::Identity()) {
    sim::BodyDescription body = solid_body(name, sim::Box{half_extents}, sim::RigidKind::fixed, centre);
    body.pose.R_WB = turn;
    scene.bodies.push_back(body);
  }
  void ground() { scene.bodies.push_back(plane_body("ground", Vec3::UnitY(), 0, 0.5)); }
  void dock() {
    ground();
    fixed_box("dock", {1, 0.75, 10}, {1, 0.75, 0});
    fixed_box("wall", {1, 5, 10}, {3, 5, 0});
  }
  sim::BodyDescription& example(const std::string& name, const SharedSet& set, double mass, const Vec3& position,
                           const sim::example_based::ExampleParameters& parameters) {
    sim::BodyDescription body{.name = name};
    body.pose.p_WB = position;
    body.model = sim::ExampleModel{.set = set, .parameters = parameters, .mass = mass};
    return scene.bodies.emplace_back(std::move(body));
  }
  // std::uniform_real_distribution may differ between libraries; this does not.
  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53; }
  Quat any_turn() { return Quat(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized(); }

  sim::SceneDescription scene;

 private:
  std::mt19937_64 random_;
};

}  // namespace crumple::lab
