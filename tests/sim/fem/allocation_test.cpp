#include "server/sim/fem/bdf2.h"
#include "tests/sim/fem/fem_test_support.h"
#include "tests/support/allocation_counter.h"

namespace crumple::sim::fem {
namespace {

using crumple::test::count_allocations;

TEST(Allocation, AStepAllocatesNothingAfterTheFirst) {
  const TetMesh mesh = test::kuhn_box(12, 5, 5, {1, 0.3, 0.3});
  FemMaterial material;
  material.yield = 0.01;
  material.creep = 0.2;
  const RestBody rest = test::rest_body(mesh, material);
  FemState state = test::rest_state(mesh);
  test::Random random;
  for (Vec3& x : state.x) x += random.vec3(-0.05, 0.05);  // inverts some
  ASSERT_GT(inverted_count(mesh.tets, state.x, ThreadPool(1)), 0);
  const Eigen::VectorXd f = test::gravity_force(rest, {0, -9.81, 0});
  const std::vector<PrescribedNode> held{{0, Vec3::Zero()}, {1, Vec3::Zero()}};
  const StepOptions options = step_options(material, 1.0 / 60);
  for (bool float_matrix : {false, true}) {
    StepScratch scratch(float_matrix);
    const ThreadPool pool(2);
    const auto step = [&] { implicit_euler_step(rest, mesh.tets, state, f, held, options, pool, scratch); };
    EXPECT_GT(count_allocations(step), 10);  // the counter counts
    for (int k = 0; k < 3; ++k) EXPECT_EQ(count_allocations(step), 0);
  }
}

TEST(Allocation, NorDoesAStepOfBdf2AfterTheSecond) {
  const TetMesh mesh = test::kuhn_box(12, 5, 5, {1, 0.3, 0.3});
  const RestBody rest = test::rest_body(mesh, {});
  FemState state = test::rest_state(mesh);
  const Eigen::VectorXd f = test::gravity_force(rest, {0, -9.81, 0});
  const std::vector<PrescribedNode> held{{0, Vec3::Zero()}, {1, Vec3::Zero()}};
  StepScratch scratch;
  Bdf2Scratch bdf2;
  const ThreadPool pool(2);
  const auto steps = [&](int count) {
    return count_allocations([&] {
      for (int k = 0; k < count; ++k) bdf2_step(rest, mesh.tets, state, f, held, step_options(rest.material, 1.0 / 60), pool, scratch, bdf2);
    });
  };
  EXPECT_GT(steps(2), 10);
  ASSERT_TRUE(remembers(state));
  EXPECT_EQ(steps(3), 0);
  restart(state);
  EXPECT_EQ(steps(4), 0);
  ASSERT_TRUE(remembers(state));
}

}  // namespace
}  // namespace crumple::sim::fem
