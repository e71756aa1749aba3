// A finite-element body by itself, without a world.
#include "server/sim/bodies/soft_body.h"
#include "tests/sim/fem/fem_test_support.h"
#include "tests/sim/world/world_bodies.h"

#include <algorithm>
#include <tuple>

namespace crumple::sim {
namespace {

constexpr double kDt = 1.0 / 60;

class Inverted : public testing::TestWithParam<std::tuple<fem::ElementKind, Integrator>> {};

// Thrown about until tets turn over and back, of whatever elements and by whatever formula it is stepped: what the guard reads off
// the elements is what a count finds.
TEST_P(Inverted, TetsOfABodyAreThoseOfItsState) {
  const auto [element, integrator] = GetParam();
  const BodyDescription block = soft_block("block", {3, 2, 2}, 0.1, at(1, 2, 3));
  FemModel model = std::get<FemModel>(block.model);
  model.element = element;
  auto body = SoftBody::make(0, block, model, {.dt = kDt, .integrator = integrator}, "bodies[0].fem");
  ASSERT_TRUE(body) << body.error().text();
  const ThreadPool pool(1);
  fem::test::Random random;
  int most = 0, least = body->rest.tet_count();
  for (int step = 0; step < 40; ++step) {
    body->assemble(Vec3::Zero(), kDt, pool);
    const int inverted = fem::inverted_count(body->tets, body->state.x, pool);
    EXPECT_EQ(body->inverted(pool), inverted) << "step " << step;
    most = std::max(most, inverted);
    least = std::min(least, inverted);
    Eigen::VectorXd v(3 * body->node_count());
    const double speed = step % 8 < 4 ? 0.4 : 3;
    for (int n = 0; n < body->node_count(); ++n) {
      // Halfway to where it was placed, and off it.
      const Vec3 home = block.pose * body->X[n];
      v.segment<3>(3 * n) = (home - body->state.x[n]) / (2 * kDt) + random.vec3(-speed, speed);
    }
    ASSERT_TRUE(body->advance(v, kDt));
  }
  EXPECT_GT(most, 10);
  EXPECT_LT(least, 3);
}

INSTANTIATE_TEST_SUITE_P(SoftBody, Inverted,
                         testing::Combine(testing::Values(fem::ElementKind::linear_tetrahedra, fem::ElementKind::smoothed_octahedra,
                                                          fem::ElementKind::hexahedra),
                                          testing::Values(Integrator::backward_euler, Integrator::bdf2)));

}  // namespace
}  // namespace crumple::sim
