#include "server/sim/fem/corotational.h"

#include "server/sim/fem/rotation.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

using test::Random;

const Lame kLame = lame_constants(1e6, 0.3);
constexpr double kNoClamp = std::numeric_limits<double>::infinity();

Mat34 random_tet(Random& random) {
  Mat34 X;
  do {
    for (int a = 0; a < 4; ++a) X.col(a) = random.vec3(-1, 1);
  } while (edge_matrix(X).determinant() < 0.3);
  return X;
}

Mat34 deformed(Random& random, const Mat34& X) {
  Mat34 x = random.rotation() * X;
  for (int a = 0; a < 4; ++a) x.col(a) += random.vec3(-0.15, 0.15);
  return x;
}

double energy(const RestTet& rest, const Mat34& x) {
  const Mat3 Q = svd_rotation(deformation_gradient(x, rest.beta));
  return rest.fill * rest.volume * energy_density(kLame, corotational_strain(rest, x, Q));
}

Mat34 force(const RestTet& rest, const Mat34& x, const Mat3& Q, const Mat3& plastic = Mat3::Zero()) {
  return nodal_forces(rest, Q, isotropic_stress(kLame, corotational_strain(rest, x, Q) - plastic));
}

Mat3 rotation_of(const RestTet& rest, const Mat34& x) { return svd_rotation(deformation_gradient(x, rest.beta)); }

TEST(Corotational, RestStateIsStressFree) {
  Random random;
  const Mat34 X = random_tet(random);
  const RestTet rest = make_rest_tet(X, kNoClamp);
  EXPECT_LT(force(rest, X, Mat3::Identity()).norm(), 1e-8);  // E area times round-off
}

TEST(Corotational, RotationChangesNoEnergyAndTurnsForces) {
  Random random;
  for (int i = 0; i < 50; ++i) {
    const Mat34 X = random_tet(random), x = deformed(random, X);
    const RestTet rest = make_rest_tet(X, kNoClamp);
    const Mat3 R = random.rotation();
    const Mat34 turned = R * x;
    EXPECT_NEAR(energy(rest, turned), energy(rest, x), 1e-11 * energy(rest, x));
    const Mat34 f = force(rest, x, rotation_of(rest, x));
    EXPECT_LT((force(rest, turned, rotation_of(rest, turned)) - R * f).norm(), 1e-10 * f.norm());
  }
}

TEST(Corotational, ForceIsMinusEnergyGradient) {
  Random random;
  constexpr double h = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const Mat34 X = random_tet(random), x = deformed(random, X);
    const RestTet rest = make_rest_tet(X, kNoClamp, 0.6);
    const Mat34 f = force(rest, x, rotation_of(rest, x));
    for (int k = 0; k < 12; ++k) {
      Mat34 plus = x, minus = x;
      plus.data()[k] += h;
      minus.data()[k] -= h;
      EXPECT_NEAR(f.data()[k], -(energy(rest, plus) - energy(rest, minus)) / (2 * h), 1e-6 * f.norm());
    }
  }
}

TEST(Corotational, StiffnessBlocksAreForceDifferencesAtFixedRotation) {
  Random random;
  for (double limit : {kNoClamp, 1.0}) {  // 1/m: clamps these tets
    const Mat34 X = random_tet(random), x = deformed(random, X);
    const RestTet rest = make_rest_tet(X, limit, 0.6);
    EXPECT_EQ(rest.clamped, limit == 1.0);
    const Mat3 Q = rotation_of(rest, x);
    Mat12 K;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const Mat3 block = stiffness_block(rest, kLame, Q, i, j);
        K.block<3, 3>(3 * i, 3 * j) = block;
        for (int c = 0; c < 3; ++c) {
          Mat34 plus = x, minus = x;
          plus(c, j) += 0.5;  // linear in x at fixed Q: any difference is exact
          minus(c, j) -= 0.5;
          const Vec3 df = force(rest, plus, Q).col(i) - force(rest, minus, Q).col(i);
          EXPECT_LT((block.col(c) + df).norm(), 1e-9 * kLame.mu);
        }
      }
    EXPECT_LT((K - K.transpose()).norm(), 1e-12 * K.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues()(0),
              -1e-10 * K.norm());  // positive semi-definite
    for (int i = 0; i < 4; ++i)
      EXPECT_LT((K.middleRows(3 * i, 3).reshaped(9, 4).rowwise().sum()).norm(), 1e-12 * K.norm());
  }
}

TEST(Corotational, ExactStiffnessIsMinusForceDifferences) {
  Random random;
  constexpr double h = 1e-6;
  for (double limit : {kNoClamp, 1.0})
    for (int i = 0; i < 30; ++i) {
      const Mat34 X = random_tet(random);
      Mat34 x = deformed(random, X);
      if (i % 3 == 0) x.row(0) *= -1;  // mirrored
      const RestTet rest = make_rest_tet(X, limit, 0.6);
      const Mat3 plastic = 0.1 * symmetric_part(random.mat3(-1, 1));
      const Mat12 K = exact_stiffness(rest, kLame, x, rotation_of(rest, x), plastic);
      for (int k = 0; k < 12; ++k) {
        Mat34 plus = x, minus = x;
        plus.data()[k] += h;
        minus.data()[k] -= h;
        const Mat34 df = (force(rest, plus, rotation_of(rest, plus), plastic) -
                          force(rest, minus, rotation_of(rest, minus), plastic)) /
                         (2 * h);
        EXPECT_LT((K.col(k) + Eigen::Map<const Eigen::Matrix<double, 12, 1>>(df.data())).norm(), 1e-5 * K.norm());
      }
    }
}

TEST(Corotational, PiolaDerivativeIsThatOfDifferences) {
  Random random;
  constexpr double h = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const Mat3 F = random.rotation() * (Mat3::Identity() + random.mat3(-0.4, 0.4));
    if (std::abs(F.determinant()) < 0.1) continue;
    const Mat3 plastic = i % 2 ? Mat3(0.1 * symmetric_part(random.mat3(-1, 1))) : Mat3::Zero().eval();
    const auto P = [&](const Mat3& at) { return first_piola(kLame, svd_rotation(at), at, plastic); };
    const Mat9 derivative = first_piola_derivative(kLame, svd_rotation(F), F, plastic);
    for (int k = 0; k < 9; ++k) {
      Mat3 plus = F, minus = F;
      plus.data()[k] += h;
      minus.data()[k] -= h;
      const Mat3 dP = (P(plus) - P(minus)) / (2 * h);
      EXPECT_LT((derivative.col(k) - Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data())).norm(),
                1e-6 * derivative.norm());
    }
    if (plastic.isZero()) {
      EXPECT_LT((derivative - derivative.transpose()).norm(), 1e-12 * derivative.norm());
    }
  }
}

TEST(Corotational, VonMisesOfUniaxialTensionAndPureShear) {
  EXPECT_DOUBLE_EQ(von_mises(Vec3(5, 0, 0).asDiagonal()), 5);
  Mat3 shear = Mat3::Zero();
  shear(0, 1) = shear(1, 0) = 2;
  EXPECT_DOUBLE_EQ(von_mises(shear), 2 * std::sqrt(3));
  EXPECT_NEAR(von_mises(7 * Mat3::Identity()), 0, 1e-14);
}

// FORMULAS F4. Torque of the internal forces: none for polar; the QR branch and a plastic strain that is not coaxial
// make one.
TEST(Corotational, InternalForcesSumToZeroAndTorqueVanishesForPolarOnly) {
  Random random;
  const auto torque = [](const Mat34& x, const Mat34& f) {
    Vec3 sum = Vec3::Zero();
    for (int a = 0; a < 4; ++a) sum += x.col(a).cross(f.col(a));
    return sum.norm();
  };
  double qr = 0, plastic_torque = 0;
  for (int i = 0; i < 50; ++i) {
    const Mat34 X = random_tet(random), x = deformed(random, X);
    const RestTet rest = make_rest_tet(X, kNoClamp);
    const Mat3 F = deformation_gradient(x, rest.beta), Q = svd_rotation(F);
    const Mat34 f = force(rest, x, Q);
    EXPECT_LT(f.rowwise().sum().norm(), 1e-14 * f.norm());
    EXPECT_LT(torque(x, f), 1e-13 * f.norm() * x.norm());
    const Mat34 f_qr = force(rest, x, qr_rotation(F));
    EXPECT_LT(f_qr.rowwise().sum().norm(), 1e-14 * f_qr.norm());
    qr = std::max(qr, torque(x, f_qr) / f_qr.norm());
    const Mat34 f_plastic = force(rest, x, Q, 0.1 * symmetric_part(random.mat3(-1, 1)));
    plastic_torque = std::max(plastic_torque, torque(x, f_plastic) / f_plastic.norm());
  }
  EXPECT_GT(qr, 0.05);
  EXPECT_GT(plastic_torque, 0.005);
}

// yardstick S08: material point states made by another code.
TEST(Corotational, PointStatesOfS08) {
  CRUMPLE_NEED_SHARED("yardstick/S08_simple_shear_and_point_states/states.json");
  const Lame lame = lame_constants(1e6, 0.3);
  // README: |got - ref| / max(max |ref|, floor). case.json: 1e-10; the file holds 12 digits.
  const auto error = [](const Mat3& got, const Mat3& ref, double floor) {
    return (got - ref).cwiseAbs().maxCoeff() / std::max(ref.cwiseAbs().maxCoeff(), floor);
  };
  int count = 0;
  for (const auto& state : test::read_json("yardstick/S08_simple_shear_and_point_states/states.json")) {
    const Mat3 F = test::to_mat3(state["F"]);
    const Mat3 Q = rotation(F, RotationRule::svd), strain = corotational_strain(Q, F);
    SCOPED_TRACE(state["state"].get<std::string>() + " " + std::to_string(state["param"].get<double>()));
    EXPECT_LT(error(Q, test::to_mat3(state["Q"]), 1), 1e-10);
    EXPECT_LT(error(strain, test::to_mat3(state["corot_strain"]), 1e-3), 1e-10);
    EXPECT_LT(error(isotropic_stress(lame, strain), test::to_mat3(state["corot_stress"]), 1e3), 1e-10);
    EXPECT_LT(error(first_piola(lame, Q, F, Mat3::Zero()), test::to_mat3(state["corot_P"]), 1e3), 1e-10);
    const double ref = state["corot_energy_density"];
    EXPECT_LT(std::abs(energy_density(lame, strain) - ref), 1e-10 * std::max(ref, 1.0));
    ++count;
  }
  EXPECT_EQ(count, 23);
}

}  // namespace
}  // namespace crumple::sim::fem
