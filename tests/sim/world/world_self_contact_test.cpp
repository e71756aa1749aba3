// Bodies whose pieces meet themselves.
#include "tests/sim/world/world_bodies.h"

#include "tests/support/self_overlap.h"

namespace crumple::sim {
namespace {

// A strip of 1.5 m stands on end, leans a little, and falls.
SceneDescription falling_strip(bool asks, bool breaks = false) {
  BodyDescription strip = soft_block("strip", {2, 36, 1}, 0.05, at(0, 0.02, 0), Vec3::Zero(), 4e4);
  strip.pose.R_WB = Quat(Eigen::AngleAxisd(0.05, Vec3::UnitX()));
  auto& model = std::get<FemModel>(strip.model);
  model.self_contact = asks;
  model.material.cg_tolerance = 1e-4;
  model.material.damping_stiffness = 0.002;
  model.material.breakable = breaks;
  model.material.toughness = 4e3;
  SceneDescription scene;
  scene.bodies = {ground(), strip};
  return scene;
}

double height(const std::vector<Vec3>& x) {
  double y = 0;
  for (const Vec3& p : x) y += p.y() / static_cast<double>(x.size());
  return y;
}

TEST(WorldSelfContact, AStripThatFallsOnItselfPilesUp) {
  double mean_height[2], worst[2] = {0, 0};
  for (const bool asks : {false, true}) {
    const SceneDescription scene = falling_strip(asks);
    const TetMesh& mesh = *std::get<FemModel>(scene.bodies[1].model).mesh;
    auto world = make_world(scene);
    for (int k = 0; k < 360; ++k) {
      world->step();
      if (k % 10 == 0) worst[asks] = std::max(worst[asks], test::self_overlap(mesh, world->fem(1).x));
    }
    mean_height[asks] = height(world->fem(1).x);
  }
  EXPECT_GT(worst[0], 0.2);    // of the strip's volume; 0.3 measured
  EXPECT_LT(worst[1], 0.01);  // 0.003
  EXPECT_GT(mean_height[1], 1.5 * mean_height[0]);  // 27 mm is half of its thickness: it lies flat
}

TEST(WorldSelfContact, BitsDoNotDependOnThreads) {
  auto one = make_world(falling_strip(true), 1), two = make_world(falling_strip(true), 2);
  for (int k = 0; k < 120; ++k) one->step(), two->step();
  EXPECT_EQ(one->state_hash(), two->state_hash());
}

TEST(WorldSelfContact, ABodyThatMeetsItselfMayBreak) {
  auto one = make_world(falling_strip(true, true), 1), two = make_world(falling_strip(true, true), 2);
  int splits = 0, contacts = 0;
  for (int k = 0; k < 240; ++k) {
    const StepReport report = one->step();
    two->step();
    splits += report.splits;
    contacts += report.contacts;
  }
  EXPECT_GT(splits, 0);
  EXPECT_GT(contacts, 0);
  EXPECT_EQ(one->state_hash(), two->state_hash());
  for (const Vec3& x : one->fem(1).x) EXPECT_LT(x.cwiseAbs().maxCoeff(), 10);
}

}  // namespace
}  // namespace crumple::sim
