#include "server/sim/fem/tensile_part.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace crumple::sim::fem {
namespace {

// By eigenvectors.
Mat3 exact(const Mat3& sigma) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(sigma);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

Mat3 turned(std::mt19937& random, const Vec3& principal) {
  std::normal_distribution<double> normal;
  const Mat3 R = Quat(normal(random), normal(random), normal(random), normal(random)).normalized().toRotationMatrix();
  const Mat3 sigma = R * principal.asDiagonal() * R.transpose();
  return 0.5 * (sigma + sigma.transpose());
}

// Principal stresses that coincide, nearly or in full, that are zero, of either sign, and of any size.
std::vector<Mat3> stresses() {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Mat3> all{Mat3::Zero(), Mat3::Identity(), -Mat3::Identity(), Vec3(1, 1, -1).asDiagonal(), Vec3(0, 0, -3).asDiagonal(),
                        Vec3(0, 2, 0).asDiagonal()};
  for (const double size : {1e-150, 1e-100, 1e100, 1e150}) all.push_back(size * turned(random, Vec3(1, -2, 0.5)));
  for (int k = 0; k < 2000; ++k) all.push_back(turned(random, Vec3(normal(random), normal(random), normal(random))));
  for (double gap = 1; gap > 1e-20; gap *= 0.1) {
    for (const Vec3& base : {Vec3(1, 1, -2), Vec3(-1, -1, 2), Vec3(0, 0, -2), Vec3(0, 0, 2), Vec3(1, 1, 1), Vec3(-1, -1, -1),
                             Vec3(0, 1, 1)})
      all.push_back(1e7 * turned(random, base + gap * Vec3(normal(random), normal(random), normal(random))));
  }
  return all;
}

TEST(TensilePart, IsThatOfTheEigenvectorsWhateverCoincides) {
  for (const Mat3& sigma : stresses()) EXPECT_LE((tensile_part(sigma) - exact(sigma)).norm(), 1e-14 * sigma.norm()) << sigma;
}

TEST(TensilePart, AndTheRestShareNoDirection) {
  for (const Mat3& sigma : stresses()) {
    const Mat3 tensile = tensile_part(sigma);
    const double size = std::max(sigma.norm(), 1e-300);
    EXPECT_LE((tensile / size * ((sigma - tensile) / size)).norm(), 1e-13);
    EXPECT_LE((tensile - tensile.transpose()).norm(), 1e-14 * sigma.norm());
  }
}

TEST(TensilePart, OfFourHasTheBitsOfEach) {
  const std::vector<Mat3> all = stresses();
  for (std::size_t k = 0; k + 4 <= all.size(); k += 4) {
    Mat3 four[4];
    store(tensile_parts(load(&all[k])), four);
    for (int lane = 0; lane < 4; ++lane) EXPECT_EQ(four[lane], tensile_part(all[k + lane]));
  }
}

TEST(TensilePart, OfWhatIsNotFiniteIsNot) {
  Mat3 sigma = Mat3::Identity();
  sigma(0, 1) = sigma(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(tensile_part(sigma).allFinite());
}

}  // namespace
}  // namespace crumple::sim::fem
