#include "server/lab/impulse_tuning.h"

#include <gtest/gtest.h>

#include "server/lab/destruction_scenes.h"
#include "server/sim/world.h"

namespace crumple::lab {
namespace {

// With what is suggested, barrels dent well, where they were struck hardest, and not as they come to rest.
TEST(ImpulseTuning, SuggestionsDentByBlowsAndNotByWeight) {
  sim::SceneDescription scene = *destruction_scene("dock");
  const auto tuned = suggest_parameters(scene, {.steps = 500});
  ASSERT_TRUE(tuned) << tuned.error().text();
  const Json& groups = (*tuned)["groups"];
  ASSERT_EQ(groups.size(), 1u);  // one asset, one mass
  EXPECT_EQ(groups[0]["bodies"].size(), 3u);
  const double beta = groups[0]["suggested"]["beta"], alpha = groups[0]["suggested"]["alpha"];
  EXPECT_GE(beta, 2 * 215.9 * 9.81 * scene.dt);  // carries it twice over
  EXPECT_LE(groups[0]["impulses"]["p99"].get<double>(), groups[0]["impulses"]["most"].get<double>());

  for (sim::BodyDescription& body : scene.bodies) {
    auto* model = std::get_if<sim::ExampleModel>(&body.model);
    if (model) model->parameters.alpha = alpha, model->parameters.beta = beta;
  }
  auto world = std::move(*sim::World::create(scene));
  int dents = 0, late = 0;
  for (int k = 0; k < 1000; ++k) {
    const int now = world->step().plastic_impulses;
    dents += now;
    late += k >= 900 ? now : 0;
  }
  EXPECT_GT(dents, 5);
  EXPECT_EQ(late, 0);
  double deepest = 0;  // largest share of an example other than rest
  for (BodyId b = 0; b < scene.bodies.size(); ++b)
    if (std::holds_alternative<sim::ExampleModel>(scene.bodies[b].model))
      deepest = std::max(deepest, 1 - world->example_weights(b).col(0).minCoeff());
  EXPECT_GT(deepest, 0.2);
  EXPECT_LE(deepest, 1);
}

TEST(ImpulseTuning, ASceneWithoutExampleBodiesIsAnError) {
  const auto tuned = suggest_parameters({}, {.steps = 1});
  ASSERT_FALSE(tuned);
  EXPECT_EQ(tuned.error().field, "scene");
}

}  // namespace
}  // namespace crumple::lab
