// A step allocates nothing once its world has been where it is for a while.
#include "tests/sim/world/world_bodies.h"

#include "tests/support/allocation_counter.h"

namespace crumple::sim {
namespace {

void ease(BodyDescription& body) {
  auto& material = std::get<FemModel>(body.model).material;
  material.cg_tolerance = 1e-3;
  material.damping_stiffness = 0.01;
}

// Held at one end; of as many nodes and as stiff as multigrid is for.
SceneDescription held_beam(linear_solver::SolverKind solver) {
  BodyDescription beam = soft_block("beam", {24, 4, 4}, 0.1, at(0, 0, 0), Vec3::Zero(), 1e7);
  ease(beam);
  auto& model = std::get<FemModel>(beam.model);
  model.motions.push_back(end_of(model));
  SceneDescription scene;
  scene.bodies = {beam};
  scene.solver = solver;
  return scene;
}

// Soft blocks and a ball on soft blocks, all on the ground.
SceneDescription heap(double young, bool breakable) {
  SceneDescription scene;
  scene.bodies = {ground()};
  for (int k = 0; k < 6; ++k) {
    BodyDescription block = soft_block("block " + std::to_string(k), {2, 2, 2}, 0.1, at(0.25 * (k % 3), 0.22 * (k / 3), 0.03 * (k / 3)),
                                       Vec3::Zero(), young);
    ease(block);
    std::get<FemModel>(block.model).material.breakable = breakable;
    std::get<FemModel>(block.model).material.toughness = 1e9;
    scene.bodies.push_back(block);
  }
  scene.bodies.push_back(ball("ball", 0.1, 2, at(0.1, 0.52, 0.12)));
  scene.sleep.speed = 0;
  return scene;
}

int allocations_of_steps(const SceneDescription& scene, int before, int steps, bool in_contact) {
  auto world = make_world(scene, 2);
  int contacts = 0, splits = 0;
  const auto step = [&](int count) {
    for (int k = 0; k < count; ++k) {
      const StepReport report = world->step();
      contacts = report.contacts;
      splits += report.splits;
    }
  };
  step(before);
  const int allocations = test::count_allocations([&] { step(steps); });
  EXPECT_EQ(contacts > 0, in_contact);
  EXPECT_EQ(splits, 0);
  return allocations;
}

TEST(WorldAllocation, TheCounterCounts) {
  EXPECT_GT(test::count_allocations([] { make_world(held_beam(linear_solver::SolverKind::automatic)); }), 100);
}

TEST(WorldAllocation, NoneOfABodyThatHangs) {
  using enum linear_solver::SolverKind;
  for (const auto solver : {automatic, jacobi, rigid_modes, multigrid})
    EXPECT_EQ(allocations_of_steps(held_beam(solver), 30, 20, false), 0) << static_cast<int>(solver);
}

// What is made once is made with the world: a large body's first step would miss 60 Hz. What is left is room for the step's outcome.
TEST(WorldAllocation, HardlyAnyOfTheFirstStepOfABodyThatHangs) {
  auto world = make_world(held_beam(linear_solver::SolverKind::multigrid), 2);
  EXPECT_LT(test::count_allocations([&] { world->step(); }), 50);
}

// With pressure patches, in either formula of time.
TEST(WorldAllocation, NoneOfAHangingBodyOfOctahedraOfRubber) {
  for (const Integrator integrator : {Integrator::backward_euler, Integrator::bdf2}) {
    SceneDescription scene = held_beam(linear_solver::SolverKind::multigrid);
    scene.integrator = integrator;
    auto& model = std::get<FemModel>(scene.bodies[0].model);
    model.element = fem::ElementKind::smoothed_octahedra;
    model.material.poisson = 0.49;
    EXPECT_EQ(allocations_of_steps(scene, 30, 20, false), 0);
  }
}

TEST(WorldAllocation, NoneOfAHangingBodyOfHexahedra) {
  for (const Integrator integrator : {Integrator::backward_euler, Integrator::bdf2}) {
    SceneDescription scene = held_beam(linear_solver::SolverKind::multigrid);
    scene.integrator = integrator;
    std::get<FemModel>(scene.bodies[0].model).element = fem::ElementKind::hexahedra;
    EXPECT_EQ(allocations_of_steps(scene, 30, 20, false), 0);
  }
}

TEST(WorldAllocation, NoneOfAHeapThatRests) {
  for (const double young : {1e5, 1e7}) EXPECT_EQ(allocations_of_steps(heap(young, false), 400, 20, true), 0) << young;
}

TEST(WorldAllocation, NoneWhereWhatTouchesMayBreakAndDoesNot) { EXPECT_EQ(allocations_of_steps(heap(1e6, true), 400, 20, true), 0); }

TEST(WorldAllocation, NoneOfABodyThatLiesOnItself) {
  BodyDescription strip = soft_block("strip", {2, 36, 1}, 0.05, at(0, 0.02, 0), Vec3::Zero(), 4e5);
  strip.pose.R_WB = Quat(Eigen::AngleAxisd(0.05, Vec3::UnitX()));
  ease(strip);
  std::get<FemModel>(strip.model).self_contact = true;
  SceneDescription scene;
  scene.bodies = {ground(), strip};
  scene.sleep.speed = 0;
  EXPECT_EQ(allocations_of_steps(scene, 600, 20, true), 0);
}

TEST(WorldAllocation, NoneOfAWorldAsleep) {
  SceneDescription scene = heap(1e6, false);
  scene.bodies.pop_back();  // the ball rolls on for ever
  scene.sleep = {};
  auto world = make_world(scene, 2);
  for (int k = 0; k < 3000 && world->workload().live_bodies > 0; ++k) world->step();
  ASSERT_EQ(world->workload().live_bodies, 0);
  EXPECT_EQ(test::count_allocations([&] { world->step(), world->step(); }), 0);
}

TEST(WorldAllocation, NoneWhereSomeSleepAndOthersMove) {
  SceneDescription scene = held_beam(linear_solver::SolverKind::automatic);
  BodyDescription block = soft_block("block", {2, 2, 2}, 0.1, at(0, -5, 0), Vec3::Zero(), 1e6);
  block.asleep = true;
  scene.bodies.push_back(block);
  auto world = make_world(scene, 2);
  for (int k = 0; k < 20; ++k) world->step();
  ASSERT_EQ(world->workload().live_bodies, 1);
  ASSERT_EQ(world->workload().asleep_bodies, 1);
  EXPECT_EQ(test::count_allocations([&] { world->step(), world->step(); }), 0);
}

}  // namespace
}  // namespace crumple::sim
