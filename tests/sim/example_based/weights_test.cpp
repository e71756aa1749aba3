#include "server/sim/example_based/weights.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(DistanceWeights, AreBarycentricAtAnyScale) {
  std::mt19937 random(16);
  for (double scale : {1e-150, 1e-3, 1.0, 1e3, 1e150}) {
    std::vector<Vec3> vertices, bones;
    for (int i = 0; i < 200; ++i) vertices.push_back(scale * random_vector(random));
    for (int b = 0; b < 32; ++b) bones.push_back(scale * random_vector(random));
    const Eigen::MatrixXd W = distance_weights(vertices, bones);
    EXPECT_LT(simplex_error(W), 1e-12) << scale;
  }
}

TEST(DistanceWeights, AreOneAtTheBoneAndSharedByBonesInOnePlace) {
  const std::vector<Vec3> bones{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 0, 0)};
  const Eigen::MatrixXd W = distance_weights(std::vector<Vec3>{Vec3(0, 0, 0), Vec3(1, 0, 0)}, bones);
  EXPECT_TRUE(W.row(0).isApprox(Eigen::RowVector3d(1, 0, 0), 0));
  EXPECT_TRUE(W.row(1).isApprox(Eigen::RowVector3d(0, 0.5, 0.5), 0));
}

TEST(DistanceWeights, AreShepardsWithTheFourthPower) {
  const std::vector<Vec3> bones{Vec3(0, 0, 0), Vec3(3, 0, 0)};
  const Eigen::MatrixXd W = distance_weights(std::vector<Vec3>{Vec3(1, 0, 0)}, bones);
  EXPECT_NEAR(W(0, 0), 16.0 / 17.0, 1e-15);
}

TEST(DistanceWeights, MirrorWithTheirBonesAndFallMonotonouslyBetween) {
  std::vector<Vec3> line;
  for (int k = 0; k <= 100; ++k) line.emplace_back(0, 0.1, k / 100.0);
  const Eigen::MatrixXd W = distance_weights(line, std::vector<Vec3>{Vec3(0, 0, 0), Vec3(0, 0, 1)});
  for (int k = 0; k <= 100; ++k) {
    EXPECT_NEAR(W(k, 0), W(100 - k, 1), 1e-12);
    if (k > 0) {
      EXPECT_LT(W(k, 0), W(k - 1, 0));
    }
  }
}

}  // namespace
}  // namespace crumple::sim::example_based
