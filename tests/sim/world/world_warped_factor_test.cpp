#include "tests/sim/world/world_bodies.h"

// Whole worlds whose bodies are solved by the factor of their rest state, until they break.
namespace crumple::sim {
namespace {

using linear_solver::SolverKind;

FemModel& fem_of(SceneDescription& scene, std::size_t body) { return std::get<FemModel>(scene.bodies[body].model); }

// A stiff plank on the ground, a bar that spins in the air, and a pane in a frame with a ball on its way into it.
SceneDescription three_bodies(SolverKind solver) {
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.solver = solver;
  scene.bodies = {soft_block("plank", {6, 2, 2}, 0.1, at(0, 0.001, 0), Vec3::Zero(), 1e8),
                  soft_block("bar", {8, 1, 1}, 0.1, at(0, 3, 0), Vec3(0, 4, 0), 1e8),
                  soft_block("pane", {10, 10, 1}, 0.1, at(5, 0.5, 0), Vec3::Zero(), 3e7),
                  ball("ball", 0.15, 20, at(5.5, 1, 1), Vec3(0, 0, -20)), ground()};
  scene.bodies[1].angular_velocity = Vec3(1, 2, 5);
  for (std::size_t b = 0; b < 3; ++b) {
    fem_of(scene, b).material.cg_tolerance = 1e-4;
    fem_of(scene, b).material.damping_stiffness = 0.001;
  }
  FemModel& pane = fem_of(scene, 2);
  pane.material.breakable = true;
  pane.material.toughness = 2e4;
  NodeMotion frame;
  for (int n = 0; n < pane.mesh->node_count(); ++n) {
    const Vec3& X = pane.mesh->X[n];
    if (X.x() < 0.01 || X.x() > 0.99) frame.nodes.push_back(n);
  }
  pane.motions.push_back(frame);
  return scene;
}

TEST(WorldWarpedFactor, StepsFromRestThroughFractureAndSleepWithTheSameBitsForAnyThreads) {
  std::uint64_t hash[2] = {};
  for (int k = 0; k < 2; ++k) {
    const auto world = make_world(three_bodies(SolverKind::warped_factor), k + 1);
    int splits = 0, capped = 0;
    for (int step = 0; step < 200; ++step) {
      const StepReport report = world->step();
      splits += report.splits;
      capped += report.capped_solves;
      if (step == 150) EXPECT_GT(world->workload().asleep_bodies, 0);  // the plank
      if (step == 160) ASSERT_TRUE(world->submit(ApplyImpulse{.body = world->find("plank"), .impulse = Vec3(0, 20, 0), .point = Vec3(0.3, 0.1, 0.1)}));
    }
    EXPECT_GT(splits, 0);
    EXPECT_EQ(capped, 0);
    hash[k] = world->state_hash();
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(WorldWarpedFactor, ABodyInTheAirMovesAsByADirectSolve) {
  std::vector<Vec3> x[2];
  for (int k = 0; k < 2; ++k) {
    SceneDescription scene = three_bodies(k == 0 ? SolverKind::warped_factor : SolverKind::direct);
    scene.bodies.erase(scene.bodies.begin() + 2, scene.bodies.begin() + 4);
    fem_of(scene, 1).material.cg_tolerance = 1e-9;
    const auto world = make_world(scene);
    for (int step = 0; step < 30; ++step) world->step();
    const FemView view = world->fem(world->find("bar"));
    x[k].assign(view.x.begin(), view.x.end());
  }
  for (std::size_t n = 0; n < x[0].size(); ++n) EXPECT_LT((x[0][n] - x[1][n]).norm(), 1e-6) << n;
}

// A beam of 425 nodes from a wall: in a scene that leaves the solver open its factor is made with the world and taken from the first
// step on, by either formula; where a ball lies on it, and after that, steps go on as by multigrid.
TEST(WorldWarpedFactor, AHeldBodyIsSolvedByTheFactorThatWasMadeWithTheWorld) {
  for (const Integrator integrator : {Integrator::backward_euler, Integrator::bdf2}) {
    std::vector<Vec3> x[2];
    int alone[2] = {}, capped = 0, contacts = 0;
    for (int k = 0; k < 2; ++k) {
      SceneDescription scene;
      scene.dt = 1.0 / 60;
      scene.integrator = integrator;
      scene.sleep.speed = 0;
      scene.solver = k == 0 ? SolverKind::automatic : SolverKind::multigrid;
      scene.bodies = {soft_block("beam", {16, 4, 4}, 0.05, at(0, 0, 0), Vec3::Zero(), 1e7), ball("ball", 0.1, 2, at(0.7, 2, 0.1), Vec3::Zero())};
      FemModel& beam = fem_of(scene, 0);
      beam.material.cg_tolerance = 1e-6;
      beam.motions.push_back(end_of(beam));
      const auto world = make_world(scene, k + 1);
      for (int step = 0; step < 90; ++step) {
        const StepReport report = world->step();
        if (step < 30) alone[k] += report.solver_iterations;
        capped += report.capped_solves;
        contacts += report.contacts;
      }
      const FemView view = world->fem(0);
      x[k].assign(view.x.begin(), view.x.end());
    }
    EXPECT_LT(2 * alone[0], alone[1]);
    EXPECT_EQ(capped, 0);
    EXPECT_GT(contacts, 0);
    for (std::size_t n = 0; n < x[0].size(); ++n) EXPECT_LT((x[0][n] - x[1][n]).norm(), 1e-4) << n;
  }
}

}  // namespace
}  // namespace crumple::sim
