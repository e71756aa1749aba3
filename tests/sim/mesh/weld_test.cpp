#include "server/sim/mesh/weld.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple::sim {
namespace {

TEST(Weld, FindsTheFirstPointWithinReachWhereverTheGridLies) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int k = 0; k < 500; ++k) {
    const Vec3 p(number(random), number(random), number(random)), way(number(random), number(random), number(random));
    const double tolerance = 1e-5;
    const std::vector<Vec3> points{Vec3(3, 3, 3), p, p + 0.9 * tolerance * way.normalized(), p + 1.1 * tolerance * way.normalized()};
    EXPECT_EQ(weld(points, tolerance), (std::vector{0, 1, 1, 3}));
  }
}

TEST(Weld, WithoutToleranceOnlyEqualPointsAreOne) {
  EXPECT_EQ(weld(std::vector<Vec3>{Vec3(1, 2, 3), Vec3(1, 2, 3), Vec3(1, 2, 3.0000001)}, 0), (std::vector{0, 0, 2}));
  EXPECT_TRUE(weld(std::vector<Vec3>{}, 1).empty());
}

}  // namespace
}  // namespace crumple::sim
