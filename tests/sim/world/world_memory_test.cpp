// What a world keeps, by what malloc has given out and not got back.
#include "tests/sim/world/world_bodies.h"

#include <malloc.h>

namespace crumple::sim {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kCounts = false;  // its malloc does not say
#else
constexpr bool kCounts = true;
#endif

double bytes_in_use() {
  const auto now = mallinfo2();
  return static_cast<double>(now.uordblks + now.hblkhd);
}

// A beam from a wall, its scene's mesh included and what a world without it has not.
double bytes_per_tet(double young, fem::ElementKind element) {
  const std::array<int, 3> cells{30, 10, 10};
  double bytes = 0;
  for (const bool with : {false, true}) {
    const double before = bytes_in_use();
    SceneDescription scene;
    scene.bodies = {ball("ball", 0.1, 1, at(0, 5, 0))};
    if (with) {
      scene.bodies.push_back(soft_block("beam", cells, 0.1, at(0, 0, 0), Vec3::Zero(), young));
      FemModel& model = std::get<FemModel>(scene.bodies.back().model);
      model.element = element;
      model.material.damping_stiffness = 0.004;
      NodeMotion wall;
      for (int n = 0; n < model.mesh->node_count(); ++n)
        if (model.mesh->X[n].x() < 1e-6) wall.nodes.push_back(n);
      model.motions.push_back(wall);
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
  const double bytes = bytes_per_tet(1e7, fem::ElementKind::linear_tetrahedra);
  EXPECT_LT(bytes, 1024);
  EXPECT_GT(bytes, 500);  // or it was not counted
}

// Too stiff for a matrix in float: one in double, and a copy in float for coarse levels.
TEST(WorldMemory, AStiffBodyTakesAnotherMatrixAndAHalf) {
  if (!kCounts) GTEST_SKIP() << "malloc does not count";
  const double stiff = bytes_per_tet(1e12, fem::ElementKind::linear_tetrahedra);
  EXPECT_LT(stiff, 1300);
  EXPECT_GT(stiff, 1024);
}

}  // namespace
}  // namespace crumple::sim
