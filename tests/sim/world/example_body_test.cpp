#include "server/sim/bodies/example_body.h"
#include "server/sim/example_based/draw_shape.h"
#include "tests/sim/world/world_bodies.h"

#include <algorithm>
#include <limits>

namespace crumple::sim {
namespace {

constexpr double kDt = 1.0 / 60;

// How far the points reach along n.
double reach(const std::vector<Vec3>& points, const Vec3& n) {
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Vec3& p : points) farthest = std::max(farthest, n.dot(p));
  return farthest;
}

// What the shape reaches further than its collision proxy does, at most over some directions [m].
double proxy_lag(const ExampleBody& body) {
  double worst = 0;
  for (const auto& part : body.rest().hull_vertices) {
    std::vector<Vec3> now;
    for (int i : part) now.push_back(body.state.x[i]);
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
      worst = std::max(worst, reach(now, n) - reach(body.proxy.X, n));
    }
  }
  return worst;
}

struct StruckBarrel : testing::Test {
  RigidWorld rigid;
  SharedRests rests;
  ThreadPool pool{1};
  BodyDescription description = barrel("barrel", at(0, 1, 0));
  Result<ExampleBody> body = ExampleBody::make(0, description, std::get<ExampleModel>(description.model), rigid, "b", rests);

  DentOutcome step() {
    body->deform(kDt, kDt, pool);
    return body->settle(rigid);
  }
};

TEST_F(StruckBarrel, CollisionShapeFollowsWithinItsLagAndIsExactAtRest) {
  ASSERT_TRUE(body);
  body->strike(Vec3(0.33, 0, 0), Vec3(-40, 0, 0));
  EXPECT_GT(step().plastic, 0);
  double largest_lag = proxy_lag(*body);
  int steps = 1;
  for (; !body->state.active.empty() && steps < 5000; ++steps) {
    step();
    largest_lag = std::max(largest_lag, proxy_lag(*body));
  }
  EXPECT_LT(steps, 5000);
  EXPECT_LT(body->state.E.col(0).minCoeff(), 0.99) << "the barrel must be dented for this to say anything";
  EXPECT_LT(largest_lag, 4.7e-3);  // four thousandths of its 1.1 m
  EXPECT_LT(proxy_lag(*body), 1e-12);
}

TEST_F(StruckBarrel, ManySmallImpulsesAddUpAtTheirVertex) {
  ASSERT_TRUE(body);
  for (int k = 0; k < 3; ++k) body->strike(Vec3(0.33, 0, 0), Vec3(-0.4, 0, 0));  // beta is 1 N s
  EXPECT_EQ(step().plastic, 1);
  for (int k = 0; k < 2; ++k) body->strike(Vec3(0.33, 0, 0), Vec3(-0.4, 0, 0));
  EXPECT_EQ(step().plastic, 0);
}

// Nor may it drop what fatigue would remember.
TEST_F(StruckBarrel, SmallImpulsesAreRememberedFromWhenItIsAskedFor) {
  ASSERT_TRUE(body);
  const auto dents = [&] {
    int count = 0;
    for (int k = 0; k < 3; ++k) {
      body->strike(Vec3(0.33, 0, 0), Vec3(-0.4, 0, 0));  // beta is 1 N s
      count += step().plastic;
    }
    return count;
  };
  EXPECT_EQ(dents(), 0);
  SetExampleParameters tired{0};
  tired.fatigue_time = 5;
  body->set_parameters(tired);
  EXPECT_EQ(dents(), 1);
}

// The quick way out for bodies at rest must know of regions that yield before the body's beta does.
TEST_F(StruckBarrel, AWeakRegionYieldsBelowTheBodysBeta) {
  ASSERT_TRUE(body);
  auto set = std::make_shared<example_based::ExampleSet>(*body->rest().set);
  set->beta_scale.assign(set->vertex_count(), 1);
  for (int i = 0; i < set->vertex_count(); ++i)
    if (set->mesh.X[i].x() > 0.2) set->beta_scale[i] = 0.1;
  auto& model = std::get<ExampleModel>(description.model);
  model.set = set;
  body = ExampleBody::make(1, description, model, rigid, "b", rests);
  ASSERT_TRUE(body);
  body->strike(Vec3(0.33, 0, 0), Vec3(-0.4, 0, 0));  // beta is 1 N s, here 0.1
  EXPECT_EQ(step().plastic, 1);
  body->strike(Vec3(-0.33, 0, 0), Vec3(0.4, 0, 0));
  EXPECT_EQ(step().plastic, 0);
}

// What a viewer colours: a channel for each example but the rest pose.
TEST_F(StruckBarrel, ItsValuesAreTheWeightsOfItsExamplesByName) {
  ASSERT_TRUE(body);
  const BodyTopology drawn = body->topology(description);
  EXPECT_EQ(drawn.channels, (std::vector<std::string>{"crushed_side", "squashed", "bent", "crumpled"}));
  body->strike(Vec3(0.33, 0, 0), Vec3(-40, 0, 0));
  for (int k = 0; k < 100; ++k) step();
  BodyFrame frame;
  body->capture(Pose{}, true, frame);
  const std::size_t n = drawn.vertices.size();
  ASSERT_EQ(frame.values.size(), 4 * n);
  std::vector<float> weights(4 * n);
  example_based::draw_weights(body->rest(), body->state, weights);
  EXPECT_EQ(frame.values, weights);
  EXPECT_GT(*std::ranges::max_element(frame.values), 0.1f);
  body->capture(Pose{}, false, frame);
  EXPECT_TRUE(frame.values.empty());
}

// Two barrels, of which the second falls; its parameters change while it is in the air.
struct Fallen {
  example_based::WeightMatrix E;
  double height;
};
Fallen fall(const SetExampleParameters& changed) {
  SceneDescription scene;
  scene.dt = 0.004;
  BodyDescription body = barrel("barrel", at(0, 2, 0));
  body.pose.R_WB = Eigen::AngleAxisd(0.7, Vec3(1, 0, 0.3).normalized());
  std::get<ExampleModel>(body.model).parameters = {.alpha = 100, .beta = 1, .gamma = 0.4, .lambda = 0.95, .restitution = 1};
  scene.bodies = {ground(), body};
  std::get<RigidModel>(scene.bodies[0].model).restitution = 1;
  auto world = make_world(scene);
  for (int k = 0; k < 10; ++k) world->step();
  EXPECT_TRUE(world->submit(changed));
  for (int k = 0; k < 500; ++k) world->step();
  return {world->example_weights(1), world->pose(1).p_WB.y()};
}

TEST(ExampleParameters, EachActsFromTheStepInWhichItIsChanged) {
  using S = SetExampleParameters;
  const Fallen as_it_was = fall(S{1});
  for (const S& changed : {S{1, 50}, S{1, {}, 20}, S{1, {}, {}, 0.2}, S{1, {}, {}, {}, 0.5}}) {
    EXPECT_GT((fall(changed).E - as_it_was.E).norm(), 0.01);
  }
  EXPECT_EQ(fall(S{1, {}, 1e9}).E.leftCols(1), example_based::WeightMatrix::Ones(as_it_was.E.rows(), 1));  // yields to nothing
  // Restitution: less is lost, it comes back sooner, there was less to begin with.
  for (const S& changed : {S{1, {}, {}, {}, {}, 50}, S{1, {}, {}, {}, {}, {}, 0.0}, S{1, {}, {}, {}, {}, {}, {}, 0.2}}) {
    EXPECT_GT(std::abs(fall(changed).height - as_it_was.height), 1e-3);
  }
}

// What goes beyond the paper can be changed, too.
TEST(ExampleParameters, GoalAndVolumeTakeEffect) {
  SetExampleParameters few{1}, kept{1};
  few.secondary_goal = example_based::ExampleParameters::SecondaryGoal::few_examples;
  few.goal_tolerance = 1e-2;
  kept.keep_volume = true;
  const Fallen as_it_was = fall({1});
  EXPECT_LT((fall(few).E.array() > 0).count(), (as_it_was.E.array() > 0).count());
  EXPECT_GT((fall(kept).E - as_it_was.E).norm(), 0.01);
}

// 20 kg at rest on the ground; beta 20 N s. Its weight would have to be remembered for 0.1 s at one place to reach beta.
TEST(ExampleFatigue, WeightAloneDentsOnlyWhereItIsRememberedLongEnough) {
  for (const double memory : {0.0, 0.05, 2.0}) {
    SceneDescription scene;
    scene.dt = 0.004;
    scene.bodies = {ground(), barrel("barrel", at(0, 0.46, 0))};
    auto& model = std::get<ExampleModel>(scene.bodies[1].model);
    model.parameters.beta = 20;
    model.parameters.fatigue_time = memory;
    auto world = make_world(scene);
    for (int k = 0; k < 1000; ++k) world->step();
    const double dented = (1 - world->example_weights(1).col(0).array()).sum();
    if (memory < 1) {
      EXPECT_EQ(dented, 0);
    } else {
      EXPECT_GT(dented, 1);
    }
  }
}

// A trough of three by two cubes whose middle upper one is missing, and a ball above it that fits in.
TEST(TetCollision, ABallFallsIntoANotchThatTheConvexPartFills) {
  const TetMesh whole = test::kuhn_lattice({3, 2, 2}, 0.3);
  TetMesh trough;
  std::vector<int> place(whole.X.size(), -1);
  for (Tet tet : whole.tets) {
    Vec3 middle = Vec3::Zero();
    for (const int n : tet) middle += whole.X[n] / 4;
    if (middle.x() > 0.3 && middle.x() < 0.6 && middle.y() > 0.3) continue;
    for (int& n : tet) {
      if (place[n] < 0) place[n] = static_cast<int>(trough.X.size()), trough.X.push_back(whole.X[n]);
      n = place[n];
    }
    trough.tets.push_back(tet);
  }
  example_based::ExampleSet set;
  set.mesh = trough;
  set.W = Eigen::MatrixXd::Ones(trough.node_count(), 1);
  set.examples = {{"rest", std::vector<example_based::BoneTransform>(1)}};
  set.convex_parts.emplace_back();
  for (int n = 0; n < trough.node_count(); ++n) set.convex_parts[0].push_back(n);
  const auto ball_height = [&](bool tets) {
    ExampleModel model{.set = std::make_shared<example_based::ExampleSet>(set), .mass = 100};
    model.parameters.tet_collision = tets;
    model.parameters.beta = 1e6;
    SceneDescription scene;
    scene.bodies = {ground(), {.name = "trough", .pose = at(0, 0, 0), .model = model}, ball("ball", 0.12, 0.5, at(0.45, 0.75, 0.3))};
    auto world = make_world(scene);
    for (int k = 0; k < 240; ++k) world->step();
    return world->pose(2).p_WB.y();
  };
  EXPECT_NEAR(ball_height(true), 0.3 + 0.12, 0.01);
  EXPECT_NEAR(ball_height(false), 0.6 + 0.12, 0.01);
}

TEST(ExampleParameters, AreLimitedAndOfExampleBodiesOnly) {
  auto world = make_world(empty_space({barrel("barrel", at(0, 0, 0)), ball("ball", 1, 1, at(5, 0, 0))}));
  const auto bad = world->submit(SetExampleParameters{0, {}, {}, 0.0});
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().field, "gamma");
  SetExampleParameters tired{0};
  tired.fatigue_time = -1;
  ASSERT_FALSE(world->submit(tired));
  EXPECT_EQ(world->submit(tired).error().field, "fatigue_time");
  const auto rigid = world->submit(SetExampleParameters{1, 1.0});
  ASSERT_FALSE(rigid);
  EXPECT_EQ(rigid.error().field, "body");
}

}  // namespace
}  // namespace crumple::sim
