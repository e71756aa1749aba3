#include "server/sim/fem/rotation.h"

#include "tests/sim/fem/fem_test_support.h"

#include <limits>

namespace crumple::sim::fem {
namespace {

using test::Random;

void expect_rotation(const Mat3& Q) {
  EXPECT_LT((Q.transpose() * Q - Mat3::Identity()).norm(), 1e-12);
  EXPECT_NEAR(Q.determinant(), 1, 1e-12);
}

double asymmetry(const Mat3& A) { return (A - A.transpose()).norm() / std::max(A.norm(), 1e-300); }

TEST(Rotation, EveryRuleGivesARotationForEveryF) {
  Random random;
  std::vector<Mat3> cases{Mat3::Zero(), Mat3::Identity(), -Mat3::Identity()};
  for (double scale : {1e-150, 1e-8, 1.0, 1e6, 1e100}) {
    cases.push_back(scale * Vec3(1, 1, 0).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Vec3(0, 1, 1).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Vec3(1, 0, 0).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Vec3(0, 0, -1).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Vec3(1, 1, 1e-12).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Vec3(1, 1e-12, -1e-12).asDiagonal().toDenseMatrix());
    cases.push_back(scale * Mat3::Ones());
    for (int i = 0; i < 200; ++i) cases.push_back(scale * random.mat3(-1, 1));
  }
  for (const Mat3& F : cases)
    for (const Mat3& Q : {svd_rotation(F), polar_rotation(F), qr_rotation(F), rotation(F, RotationRule::svd),
                          rotation(F, RotationRule::polar_qr)})
      expect_rotation(Q);
}

TEST(Rotation, ZeroAndNotFiniteFGiveTheIdentity) {
  Mat3 bad = Mat3::Identity();
  bad(1, 2) = std::numeric_limits<double>::quiet_NaN();
  for (RotationRule rule : {RotationRule::svd, RotationRule::polar_qr}) {
    EXPECT_EQ(rotation(Mat3::Zero(), rule), Mat3::Identity());
    EXPECT_EQ(rotation(bad, rule), Mat3::Identity());
  }
}

TEST(Rotation, PolarLeavesASymmetricPositiveStretchAndEqualsTheSvd) {
  Random random;
  int tried = 0;
  while (tried < 500) {
    const Mat3 F = random.mat3(-1, 1);
    if (F.determinant() < 0.01) continue;
    ++tried;
    const Mat3 Q = polar_rotation(F), S = Q.transpose() * F;
    EXPECT_LT(asymmetry(S), 1e-13);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(S).eigenvalues()(0), 0);
    EXPECT_LT((Q - svd_rotation(F)).norm(), 1e-12);
  }
}

// F as flat and as thin as polar_factor.h lets in, and beyond, where the SVD takes over.
TEST(Rotation, PolarHoldsUpToWhereTheSvdTakesOver) {
  Random random;
  for (double thin : {0.3, 0.1, 0.03, 0.01, 0.0032, 0.0031, 0.001})
    for (int i = 0; i < 100; ++i) {
      const Mat3 Q = random.rotation(), V = random.rotation();
      for (const Vec3& stretch : {Vec3(1, thin, thin), Vec3(1, 1, thin), Vec3(1, thin, 0.9 * thin)}) {
        const Mat3 got = polar_rotation(Q * V * stretch.asDiagonal() * V.transpose());
        EXPECT_LT((got - Q).norm(), 1e-16 / (thin * thin) + 1e-12) << stretch.transpose();
        EXPECT_LT((got.transpose() * got - Mat3::Identity()).norm(), 3e-12);
      }
    }
}

TEST(Rotation, SvdOfAMirroredFCarriesTheSignOnTheSmallestStretch) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    const Mat3 Q = random.rotation(), V = random.rotation();
    const Mat3 S = V * Vec3(1.5, 1.1, -0.4).asDiagonal() * V.transpose();
    EXPECT_LT((svd_rotation(Q * S) - Q).norm(), 1e-12);
  }
}

TEST(Rotation, RankTwoIsCompletedByTheCrossProduct) {
  Random random;
  for (int i = 0; i < 100; ++i) {
    const Mat3 Q = random.rotation(), V = random.rotation();
    const Mat3 F = Q * V * Vec3(2, 1, 0).asDiagonal() * V.transpose();
    EXPECT_LT((svd_rotation(F) - Q).norm(), 1e-12);
  }
}

TEST(Rotation, QrLeavesAnUpperTriangleWithPositiveFirstDiagonals) {
  Random random;
  for (int i = 0; i < 200; ++i) {
    const Mat3 F = random.mat3(-1, 1);
    const Mat3 R = qr_rotation(F).transpose() * F;
    EXPECT_LT(std::abs(R(1, 0)) + std::abs(R(2, 0)) + std::abs(R(2, 1)), 1e-13);
    EXPECT_GT(R(0, 0), 0);
    EXPECT_GT(R(1, 1), 0);
  }
}

TEST(Rotation, PapersRuleTurnsToQrBelowSixPercentVolume) {
  Mat3 F = Mat3::Identity();
  F(0, 1) = 0.8;
  F(2, 2) = 0.061;
  EXPECT_EQ(rotation(F, RotationRule::polar_qr), polar_rotation(F));
  F(2, 2) = 0.059;
  EXPECT_EQ(rotation(F, RotationRule::polar_qr), qr_rotation(F));
  EXPECT_GT((qr_rotation(F) - polar_rotation(F)).norm(), 0.1);  // they differ there
  EXPECT_EQ(rotation(F, RotationRule::svd), polar_rotation(F));
}

// STABILITY rows 4 and 31: pure rotations up to the half turn come back.
TEST(Rotation, TurnsComeBackExactly) {
  for (double angle : {1e-9, 0.5, 2.0, 3.1, 3.14159265}) {
    const Mat3 R = Eigen::AngleAxisd(angle, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
    EXPECT_LT((polar_rotation(R * 1.3) - R).norm(), 1e-14);
    EXPECT_LT((svd_rotation(R * 1.3) - R).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace crumple::sim::fem
