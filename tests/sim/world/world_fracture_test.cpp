// Bodies that break, and nodes that follow a script.
#include "server/sim/fracture/fragments.h"
#include "tests/sim/world/world_bodies.h"

namespace crumple::sim {
namespace {

// A free pane that a ball hits; everything drifts along x at 1 m/s, so that the momentum along x is the mass.
SceneDescription shot_at_pane() {
  BodyDescription pane = soft_block("pane", {8, 8, 1}, 0.1, at(-0.4, -0.4, 0), Vec3(1, 0, 0), 1e7);
  auto& material = std::get<FemModel>(pane.model).material;
  material.breakable = true;
  material.toughness = 2e4;
  return empty_space({pane, ball("ball", 0.1, 5, at(0.02, 0.01, -0.15), Vec3(1, 0, 30))});
}

TEST(WorldFracture, BreakingRaisesTheEpochAndTellsItInOrderWithoutGaps) {
  auto world = make_world(shot_at_pane());
  const auto vertices = world->topology().bodies[0].vertices.size();
  std::uint64_t sequence = 0;
  std::uint32_t epoch = 0;
  int splits = 0, fractures = 0;
  for (int k = 0; k < 20; ++k) {
    const std::uint64_t step = world->step_count();
    const StepReport report = world->step();
    splits += report.splits;
    const auto events = world->take_events();
    bool fracture_before = false;
    for (const Event& event : events) {
      EXPECT_EQ(event.sequence, ++sequence);
      EXPECT_EQ(event.step, step);
      if (event.kind == EventKind::fracture) {
        ++fractures;
        fracture_before = true;
        EXPECT_EQ(event.body, 0u);
        EXPECT_EQ(event.count, report.splits);
        EXPECT_EQ(event.fragments, fracture::find_fragments(world->fem(0).tets).count());
        EXPECT_LT(event.point.cwiseAbs().maxCoeff(), 10);
      } else if (event.kind == EventKind::topology) {
        EXPECT_TRUE(fracture_before);
        EXPECT_EQ(event.epoch, ++epoch);
      }
    }
    EXPECT_EQ(world->topology().epoch, epoch);
    EXPECT_EQ(fracture_before, report.splits > 0);
    const Frame frame = world->capture(true);
    EXPECT_EQ(frame.epoch, epoch);
    EXPECT_EQ(frame.bodies[0].positions.size(), world->topology().bodies[0].vertices.size());
    EXPECT_EQ(frame.bodies[0].values.size(), frame.bodies[0].positions.size());
  }
  EXPECT_GT(fractures, 0);
  EXPECT_GE(splits, fractures);
  EXPECT_GT(world->fem(0).fragments, 1);
  EXPECT_GE(world->fem(0).x.size(), 9u * 9 * 2 + splits);  // a split may leave joints, which are parted as well
  EXPECT_GT(world->topology().bodies[0].vertices.size(), vertices);
}

TEST(WorldFracture, ABodysEpochIsThatOfTheLastChangeOfWhatIsDrawnOfIt) {
  auto world = make_world(shot_at_pane());
  std::uint32_t since = 0;
  for (int k = 0; k < 20; ++k) {
    const std::vector<Triangle> before = world->topology().bodies[0].triangles;
    world->step();
    const Topology& now = world->topology();
    if (now.bodies[0].triangles != before) since = now.epoch;
    EXPECT_EQ(now.bodies[0].epoch, since);
    EXPECT_EQ(now.bodies[1].epoch, 0u);  // the ball is whole
  }
  EXPECT_GT(since, 0u);
}

// A pane that is held at its rim stops a ball; one that breaks lets it through (STABILITY 23, ANCHORS: the fault of engines
// that solve contact against the mesh from before it broke).
TEST(WorldFracture, ABallKeepsMostOfItsSpeedThroughAPaneThatBreaksUnderIt) {
  const auto speed_behind = [](bool breakable) {
    SceneDescription scene = shot_at_pane();
    auto& pane = std::get<FemModel>(scene.bodies[0].model);
    pane.material.breakable = breakable;
    pane.material.cg_tolerance = 1e-6;
    NodeMotion rim;
    for (int n = 0; n < pane.mesh->node_count(); ++n) {
      const Vec3& X = pane.mesh->X[n];
      if (std::min({X.x(), X.y(), 0.8 - X.x(), 0.8 - X.y()}) < 1e-9) rim.nodes.push_back(n);
    }
    pane.motions.push_back(rim);
    scene.bodies[0].velocity = scene.bodies[1].velocity = Vec3::Zero();
    scene.bodies[1].velocity.z() = 30;
    auto world = make_world(scene);
    for (int k = 0; k < 30; ++k) world->step();
    return world->velocity(1).z();
  };
  EXPECT_LT(speed_behind(false), 3);
  EXPECT_GT(speed_behind(true), 10);  // what it hits weighs as much as the ball itself
}

// Looks ahead would break more in a step than one look may: only what comes from without is worth them.
TEST(WorldFracture, WhatBurstsByItselfIsLookedAtOnceAStep) {
  const auto most_in_a_step = [](bool with_ball) {
    SceneDescription scene = shot_at_pane();
    if (!with_ball) scene.bodies.pop_back();
    auto& pane = std::get<FemModel>(scene.bodies[0].model);
    pane.material.max_splits_per_step = 20;
    pane.rigid_fragments = 24;
    auto world = make_world(scene);
    int most = 0, touching = 0;
    for (int k = 0; k < 12; ++k) {
      if (!with_ball) {
        const Vec3 point(0.1 * k, 0, 0.05);
        EXPECT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, 0, 150), .point = point, .radius = 0.3}));
      }
      const FemView view = world->fem(0);
      const bool has_shards = view.rigid_fragments > 0;
      const StepReport report = world->step();
      const int meshes = std::max(1, view.fragments - view.rigid_fragments);  // or fewer: each is looked at for itself
      most = std::max(most, (report.splits + meshes - 1) / meshes);
      touching += has_shards && report.contacts > 0 && report.splits > 0;
    }
    if (!with_ball) EXPECT_GT(touching, 2);
    return most;
  };
  EXPECT_LE(most_in_a_step(false), 20);
  EXPECT_GT(most_in_a_step(true), 20);
}

TEST(WorldFracture, MassAndMomentumPassThroughIt) {
  auto world = make_world(shot_at_pane());
  const Vec3 before = world->energies().momentum;
  EXPECT_NEAR(before.x(), 1000 * 0.8 * 0.8 * 0.1 + 5, 1e-9);
  const std::vector<Tet> tets = world->fem(0).tets;
  int splits = 0;
  for (int k = 0; k < 20; ++k) {
    splits += world->step().splits;
    EXPECT_LT((world->energies().momentum - before).norm(), 1e-8 * before.norm()) << k;
  }
  EXPECT_GT(splits, 0);
  EXPECT_EQ(world->fem(0).tets.size(), tets.size());
}

TEST(WorldFracture, SameBitsWithTwoThreads) {
  auto one = make_world(shot_at_pane(), 1), two = make_world(shot_at_pane(), 2);
  for (int k = 0; k < 10; ++k) {
    one->step();
    two->step();
    ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
  }
  EXPECT_GT(one->fem(0).x.size(), 162u);
}

TEST(WorldFracture, PanesThatBreakInOneStepGiveTheSameBitsWithTwoThreads) {
  const SceneDescription pane = shot_at_pane();
  SceneDescription scene = pane;
  for (int copy = 1; copy < 4; ++copy)
    for (BodyDescription body : pane.bodies) {
      body.name += std::to_string(copy);
      body.pose.p_WB.x() += 5 * copy;
      scene.bodies.push_back(std::move(body));
    }
  auto one = make_world(scene, 1), two = make_world(scene, 2);
  std::size_t most = 0;
  for (int k = 0; k < 10; ++k) {
    one->step();
    two->step();
    ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
    const std::vector<Event> events = one->take_events();
    most = std::max<std::size_t>(most, std::ranges::count(events, EventKind::fracture, &Event::kind));
  }
  EXPECT_EQ(most, 4u);
}

// A bar whose left end is held and whose right end moves by keys.
SceneDescription pulled_bar(std::vector<PoseKey> keys, bool breakable) {
  BodyDescription bar = soft_block("bar", {6, 1, 1}, 0.1, at(1, 2, 3));
  auto& model = std::get<FemModel>(bar.model);
  model.material.breakable = breakable;
  model.material.toughness = 1e4;
  NodeMotion left, right{{}, std::move(keys)};
  for (int n = 0; n < model.mesh->node_count(); ++n) {
    if (model.mesh->X[n].x() < 0.01) left.nodes.push_back(n);
    if (model.mesh->X[n].x() > 0.59) right.nodes.push_back(n);
  }
  model.motions = {left, right};
  return empty_space({bar});
}

TEST(WorldKinematic, NodesFollowTheirKeys) {
  const Quat quarter(Eigen::AngleAxisd(0.5, Vec3::UnitX()));
  const SceneDescription scene = pulled_bar({{0, Pose{}}, {0.1, {quarter, Vec3(0.06, 0, 0)}}}, false);
  auto world = make_world(scene);
  const FemModel& model = std::get<FemModel>(scene.bodies[0].model);
  for (int k = 1; k <= 15; ++k) {  // the last key is at step 12
    world->step();
    const double s = std::min(1.0, k / 12.0);
    const Pose to{Quat(Eigen::AngleAxisd(0.5 * s, Vec3::UnitX())), Vec3(0.06 * s, 0, 0)};
    for (int n : model.motions[0].nodes) EXPECT_EQ(world->fem(0).x[n], scene.bodies[0].pose * model.mesh->X[n]);
    for (int n : model.motions[1].nodes) {
      EXPECT_LT((world->fem(0).x[n] - (Vec3(1, 2, 3) + to * model.mesh->X[n])).norm(), 1e-12) << k;
    }
  }
  // Stretched 10 % and settled, the middle is half way.
  for (int k = 0; k < 400; ++k) world->step();
  double middle = 0;
  int count = 0;
  for (std::size_t n = 0; n < model.mesh->X.size(); ++n) {
    if (std::abs(model.mesh->X[n].x() - 0.3) > 0.01) continue;
    middle += world->fem(0).x[n].x();
    ++count;
  }
  EXPECT_EQ(count, 4);
  EXPECT_NEAR(middle / count, 1 + 0.3 + 0.03, 2e-3);
}

TEST(WorldKinematic, SplitNodesFollowLikeTheirOrigins) {
  const SceneDescription scene = pulled_bar({{0, Pose{}}, {0.1, {Quat::Identity(), Vec3(0.3, 0, 0)}}}, true);
  auto world = make_world(scene);
  int splits = 0;
  for (int k = 0; k < 24; ++k) splits += world->step().splits;
  ASSERT_GT(splits, 0);
  EXPECT_GT(world->fem(0).fragments, 1);
  const FemModel& model = std::get<FemModel>(scene.bodies[0].model);
  const std::vector<Vec3> x = world->fem(0).x;  // of pieces
  const auto any_at = [&](const Vec3& place) { return std::ranges::any_of(x, [&](const Vec3& p) { return (p - place).norm() < 1e-12; }); };
  for (int n : model.motions[0].nodes) EXPECT_TRUE(any_at(scene.bodies[0].pose * model.mesh->X[n])) << n;
  for (int n : model.motions[1].nodes) EXPECT_TRUE(any_at(Vec3(1.3, 2, 3) + model.mesh->X[n])) << n;
}

}  // namespace
}  // namespace crumple::sim
