#include "server/rig/crush.h"

#include "server/authoring/painted_regions.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/rig_pipeline.h"
#include "server/authoring/shapes/barrel.h"
#include "server/sim/world.h"
#include "tests/rig/blocks_for_tests.h"

#include <gtest/gtest.h>

namespace crumple::rig {
namespace {

// Metal keeps its volume: pressed to about 0.7 of its length it is thicker across, by 1 / sqrt(0.7) = 1.2 in the mean.
TEST(Crush, PressedMetalStaysShortAndSwellsAcross) {
  const auto set = block();
  const auto crushed = crush(set, "pressed", {.axis = 0, .from_max = true, .depth = 0.3});
  ASSERT_TRUE(crushed) << crushed.error().text();
  EXPECT_EQ(crushed->copy.name, "pressed");
  ASSERT_EQ(crushed->copy.vertices.size(), set.render.vertices.size());
  const Vec3 before = extent(set.render.vertices), after = extent(crushed->copy.vertices);
  EXPECT_NEAR(crushed->report.thickness, 0.72, 0.05);  // it springs back by about its yield strain
  EXPECT_NEAR(after.x() / before.x(), 0.72, 0.06);
  EXPECT_NEAR(after.y() / before.y(), 1.2, 0.08);
  EXPECT_NEAR(after.z() / before.z(), 1.2, 0.08);
  EXPECT_GT(crushed->report.plastic_strain, 0.2);
  EXPECT_EQ(crushed->report.inverted_tets, 0);
}

// Where it yields late, it comes back.
TEST(Crush, ElasticMetalSpringsBack) {
  const auto crushed = crush(block(), "pressed", {.axis = 1, .from_max = false, .depth = 0.1, .yield_strain = 1});
  ASSERT_TRUE(crushed) << crushed.error().text();
  EXPECT_NEAR(crushed->report.thickness, 1, 0.02);  // it still rings when it is looked at
  EXPECT_EQ(crushed->report.plastic_strain, 0);
}

TEST(Crush, IsTheSameForAnyNumberOfThreads) {
  const auto set = block();
  const auto one = crush(set, "a", {.depth = 0.2}), two = crush(set, "a", {.depth = 0.2, .threads = 2});
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->copy.vertices, two->copy.vertices);
}

TEST(Crush, ThePoseFitsWhatWasPressed) {
  auto set = block();
  const auto crushed = crush(set, "pressed", {.depth = 0.3});
  ASSERT_TRUE(crushed) << crushed.error().text();
  const auto fitted = authoring::ExampleAuthor(set).add_copy(crushed->copy);
  ASSERT_TRUE(fitted) << fitted.error().text();
  EXPECT_LT(fitted->residual_rms, 0.04);  // of a body 2 m long, pressed by 0.6 m
  EXPECT_TRUE(sim::example_based::validate(set, "asset"));
}

// The whole way: a barrel is pressed from one side, the result is the only example, and the body, struck at that side,
// moves towards it; painted strong (black), it moves less.
TEST(Crush, ABarrelStruckDentsTowardsWhatWasPressed) {
  authoring::ArtistMesh mesh;
  mesh.surface = authoring::barrel_surface({});
  authoring::RigOptions options{.enclosing = {.tet_budget = 1200}};
  options.crushed = authoring::RigOptions::Crushed::never;
  auto made = authoring::make_asset(mesh, options);
  ASSERT_TRUE(made) << made.error().text();
  auto set = std::move(made->set);
  const Vec3 before = extent(set.render.vertices);
  const auto crushed = crush(set, "pressed", {.axis = 0, .from_max = true, .depth = 0.4, .threads = 2});
  ASSERT_TRUE(crushed) << crushed.error().text();
  EXPECT_LT(crushed->report.thickness, 0.75) << "looks crushed";
  const auto fitted = authoring::ExampleAuthor(set).add_copy(crushed->copy);
  ASSERT_TRUE(fitted) << fitted.error().text();
  EXPECT_GT(fitted->residual_rms, 0);
  EXPECT_LT(fitted->residual_rms, 0.05 * before.x());
  const double pressed = extent(authoring::skinned(set, set.examples[1].bones)).x();
  EXPECT_LT(pressed, 0.82 * before.x()) << "so does the pose";

  const auto struck = [&](const sim::example_based::ExampleSet& body) {
    sim::SceneDescription scene;
    scene.gravity = Vec3::Zero();
    scene.dt = 1.0 / 240;
    sim::RigidModel wall{.kind = sim::RigidKind::fixed, .shapes = {{{}, sim::Box{Vec3(0.5, 5, 5)}}}};
    scene.bodies.push_back(
        {.name = "wall", .pose = {Quat::Identity(), Vec3(before.x() / 2 + 0.55, 0, 0)}, .model = wall});
    sim::ExampleModel model{.set = std::make_shared<sim::example_based::ExampleSet>(body), .mass = 200};
    model.parameters.alpha = 48;
    model.parameters.beta = 20;
    model.parameters.gamma = 0.6;
    scene.bodies.push_back({.name = "barrel", .pose = {}, .velocity = Vec3(7, 0, 0), .model = model});
    auto world = sim::World::create(scene);
    EXPECT_TRUE(world) << world.error().text();
    for (int k = 0; k < 240; ++k) (*world)->step();
    return Eigen::VectorXd((*world)->example_weights((*world)->find("barrel")).col(1));
  };
  const Eigen::VectorXd E = struck(set);
  EXPECT_GT(E.maxCoeff(), 0.3);
  std::vector<Vec3> x = authoring::skinned(set, set.examples[1].bones);
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = (1 - E[static_cast<Eigen::Index>(i)]) * set.mesh.X[i] + E[static_cast<Eigen::Index>(i)] * x[i];
  EXPECT_LT(extent(x).x(), 0.97 * extent(set.mesh.X).x()) << "dented";

  set.alpha_scale.assign(set.mesh.X.size(), authoring::region_scale(0));
  EXPECT_LT(struck(set).maxCoeff(), 0.5 * E.maxCoeff()) << "a strong region";
}

TEST(Crush, NamesWhatIsOutOfRange) {
  const auto set = block();
  EXPECT_EQ(crush(set, "a", {.depth = 0.7}).error().text(), "depth is 0.7, must be in (0, 0.6]");
  EXPECT_EQ(crush(set, "a", {.yield_strain = 0}).error().text(), "yield_strain is 0, must be in [1e-4, 1]");
  auto bare = set;
  bare.render = {};
  EXPECT_FALSE(crush(bare, "a", {}));
}

}  // namespace
}  // namespace crumple::rig
