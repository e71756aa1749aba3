// What a world keeps, by what malloc has given out and not got back.
#include "tests/sim/world/world_bodies.h"

#include <malloc.h>

namespace crumple::sim {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;  // its malloc does not say
#else
constexpr bool kCounts = true;
#endif

double bytes_in_use() {
  const auto now = mallinfo2();
  return static_cast<double>(now.uordblks + now.hblkhd);
}

// A beam from a wall, its scene's mesh included and what a world without it has not.
double bytes_per_tet(const std::array<int, 3>& cells, double young, Integrator integrator = Integrator::backward_euler,
                     linear_solver::SolverKind solver = linear_solver::SolverKind::automatic) {
  double bytes = 0;
  for (const bool with : {false, true}) {
    const double before = bytes_in_use();
    SceneDescription scene;
    scene.integrator = integrator;
    scene.solver = solver;
    scene.bodies = {ball("ball", 0.1, 1, at(0, 5, 0))};
    if (with) {
      scene.bodies.push_back(soft_block("beam", cells, 0.1, at(0, 0, 0), Vec3::Zero(), young));
      FemModel& model = std::get<FemModel>(scene.bodies.back().model);
      model.material.damping_stiffness = 0.004;
      model.material.cg_tolerance = 1e-3;
      model.motions.push_back(end_of(model));
    }
    const auto world = make_world(scene);
    for (int step = 0; step < 5; ++step) world->step();
    bytes = bytes_in_use() - before - bytes;
  }
  return bytes / (6.0 * cells[0] * cells[1] * cells[2]);
}

// Asked: 1 KB a tet.
TEST(WorldMemory, AWholeBodyOfTetsTakesLessThanAKilobyteATet) {
  if (!kCounts) GTEST_SKIP() << "malloc does not count";
  const double bytes = bytes_per_tet({30, 10, 10}, 1e7);
  EXPECT_LT(bytes, 1024);
  EXPECT_GT(bytes, 500);  // or it was not counted
}

// Too stiff for a matrix in float: one in double, and a copy in float for coarse levels.
TEST(WorldMemory, AStiffBodyTakesAnotherMatrixAndAHalf) {
  if (!kCounts) GTEST_SKIP() << "malloc does not count";
  const double stiff = bytes_per_tet({30, 10, 10}, 1e12);
  EXPECT_LT(stiff, 1300);
  EXPECT_GT(stiff, 1024);
}

// Which is made with the world for held bodies of up to 1,000 nodes: one, and of BDF2 two.
TEST(WorldMemory, AFactorTakesLessThanHalfAKilobyteATet) {
  if (!kCounts) GTEST_SKIP() << "malloc does not count";
  const double without = bytes_per_tet({25, 4, 4}, 1e7, Integrator::backward_euler, linear_solver::SolverKind::multigrid), with = bytes_per_tet({25, 4, 4}, 1e7);
  const double bdf2 = bytes_per_tet({25, 4, 4}, 1e7, Integrator::bdf2);
  EXPECT_LT(with, without + 500);
  EXPECT_LT(bdf2, with + 500);
  EXPECT_GT(bdf2, with + 100);
}

}  // namespace
}  // namespace crumple::sim
