#pragma once

#include "server/io/scene_file.h"
#include "server/io/scene_folder.h"
#include "server/scene_convert/scene_convert.h"
#include "server/sim/world.h"
#include "tests/scene_convert/parse_scene.h"
#include "tests/support/shared_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

// Scenes as shipped, or with bodies made of real meshes, stepped under the eyes of what must always hold.
namespace crumple::test {

inline std::filesystem::path shipped_scene_file(const std::string& name) {
  return std::filesystem::path(CRUMPLE_SOURCE_DIR) / "deploy/scenes" / (name + ".json");
}

// As a message, to be changed before it is loaded.
inline v1::Scene shipped_scene(const std::string& name) {
  const Result<v1::Scene> scene = io::read_scene_message(shipped_scene_file(name));
  EXPECT_TRUE(scene) << scene.error().text();
  return scene.value_or(v1::Scene());
}

inline v1::Body& body_of(v1::Scene& scene, const std::string& name) {
  const auto found = std::ranges::find(*scene.mutable_bodies(), name, &v1::Body::name);
  EXPECT_NE(found, scene.mutable_bodies()->end()) << name;
  return found == scene.mutable_bodies()->end() ? *scene.add_bodies() : *found;
}

inline void keep_bodies(v1::Scene& scene, const std::vector<std::string>& names) {
  std::vector<v1::Body> kept;
  for (const std::string& name : names) kept.push_back(body_of(scene, name));
  scene.clear_bodies();
  for (const v1::Body& body : kept) *scene.add_bodies() = body;
}

// A world, and what it did so far.
class SceneRun {
 public:
  // Files that the scene names are those of the folder.
  SceneRun(const v1::Scene& message, const std::filesystem::path& folder) {
    auto scene = scene_convert::to_scene(message, io::SceneFolder(folder));
    EXPECT_TRUE(scene) << scene.error().text();
    if (scene) start(*scene);
  }
  explicit SceneRun(const sim::SceneDescription& scene) { start(scene); }

  bool started() const { return world_ != nullptr; }
  sim::World& world() const { return *world_; }

  // Everything drawn stays finite, and nothing that moves gets further below y = 0 than `ground_tolerance` [m].
  void step(int steps, double ground_tolerance) {
    for (int k = 0; k < steps; ++k) {
      const sim::StepReport report = world_->step();
      capped_solves += report.capped_solves;
      for (sim::Event& event : world_->take_events()) events.push_back(std::move(event));
      if (world_->step_count() % 10 != 0 && k + 1 < steps) continue;
      ASSERT_TRUE(look()) << "step " << world_->step_count();
      ASSERT_GT(lowest_now, -ground_tolerance) << "step " << world_->step_count() << ", " << lowest_body;
    }
  }

  int events_of(sim::EventKind kind, const std::string& body) const {
    return static_cast<int>(std::ranges::count_if(
        events, [&](const sim::Event& event) { return event.kind == kind && event.body == world_->find(body); }));
  }
  int frozen_bodies() const {
    return static_cast<int>(std::ranges::count(events, sim::EventKind::frozen, &sim::Event::kind));
  }

  // Largest share of examples other than rest over the body's vertices [-]: 0 where it was never dented.
  double dent(const std::string& body) const {
    return 1 - world_->example_weights(world_->find(body)).col(0).minCoeff();
  }
  // Rows of example weights stay in the simplex.
  bool weights_are_a_simplex(const std::string& body) const {
    const Eigen::MatrixXd& E = world_->example_weights(world_->find(body));
    return E.allFinite() && E.minCoeff() >= 0 && (E.rowwise().sum().array() - 1).abs().maxCoeff() < 1e-12;
  }
  int fragments(const std::string& body) const { return world_->fem(world_->find(body)).fragments; }

  std::vector<sim::Event> events;
  int capped_solves = 0;
  double lowest = 0, lowest_now = 0;  // of all that moves [m]: drawn vertices; nodes of finite-element bodies, whose splinters
                                      // reach beyond their tets
  std::string lowest_body;

 private:
  void start(const sim::SceneDescription& scene) {
    auto world = sim::World::create(scene);
    EXPECT_TRUE(world) << world.error().text();
    if (world) world_ = *std::move(world);
  }

  void look_at(const Vec3& p, const std::string& body) {
    if (p.y() >= lowest_now) return;
    lowest_now = p.y();
    lowest_body = body;
  }

  // False if anything drawn is not finite.
  bool look() {
    const Frame frame = world_->capture();
    lowest_now = 0;
    for (const BodyTopology& body : world_->topology().bodies) {
      if (body.model == BodyModel::fixed) continue;
      const BodyFrame& at = frame.bodies[body.id];
      const std::vector<Vec3f>& vertices = body.deformable ? at.positions : body.vertices;
      for (const Vec3f& x : vertices) {
        const Vec3 p = body.deformable ? Vec3(x.cast<double>()) : at.pose * Vec3(x.cast<double>());
        if (!p.allFinite()) return false;
        if (body.model != BodyModel::fem) look_at(p, body.name);
      }
      if (body.model != BodyModel::fem) continue;
      for (const Vec3& p : world_->fem(body.id).x) look_at(p, body.name);
    }
    lowest = std::min(lowest, lowest_now);
    const sim::Energies energies = world_->energies();
    return std::isfinite(energies.kinetic) && std::isfinite(energies.elastic) && energies.momentum.allFinite();
  }

  std::unique_ptr<sim::World> world_;
};

inline SceneRun run_shipped(const std::string& name) {
  const auto loaded = io::load_scene(shipped_scene_file(name));
  EXPECT_TRUE(loaded) << loaded.error().text();
  return SceneRun(loaded ? loaded->scene : sim::SceneDescription());
}

}  // namespace crumple::test
