#include "server/sim/fem/bdf2.h"
#include "tests/sim/fem/fem_test_support.h"

#include <Eigen/SVD>

// STABILITY rows 1 to 3: a cube of 4^3 x 6 tets, side 1 m, E = 1e5, nu = 0.3, dt = 1/60, scrambled, mirrored or
// flattened, must find its shape again.
namespace crumple::sim::fem {
namespace {

const ThreadPool kOne(1);

// Largest distance of a node from the best rigid placement of the rest shape [m].
double shape_error(const TetMesh& mesh, const std::vector<Vec3>& x) {
  Vec3 X_mean = Vec3::Zero(), x_mean = Vec3::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    X_mean += mesh.X[i] / x.size();
    x_mean += x[i] / x.size();
  }
  Mat3 H = Mat3::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) H += (x[i] - x_mean) * (mesh.X[i] - X_mean).transpose();
  const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Mat3 R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    worst = std::max(worst, (R * (mesh.X[i] - X_mean) - (x[i] - x_mean)).norm());
  return worst;
}

struct Outcome {
  int inverted;
  double shape_error;
  double kinetic, largest_kinetic;
  double elastic, start_elastic;
};

Outcome recover(const std::function<Vec3(const Vec3&)>& deform, RotationRule rule = RotationRule::svd,
                int steps = 120, bool bdf2 = false, const TetMesh& mesh = test::kuhn_box(4, 4, 4, {1, 1, 1}),
                ElementKind element = ElementKind::linear_tetrahedra) {
  FemMaterial material;
  material.young = 1e5;
  material.rotation = rule;
  const RestBody rest = test::rest_body(mesh, material, 0, {}, element);
  FemState state = test::rest_state(mesh);
  state.plastic_strain.assign(rest.point_count(), Mat3::Zero());
  for (Vec3& x : state.x) x = deform(x);
  StepScratch scratch;
  Bdf2Scratch bdf2_scratch;
  Outcome outcome{};
  outcome.start_elastic = elastic_energy(rest, mesh.tets, state.x, state.plastic_strain);
  for (int k = 0; k < steps; ++k) {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * mesh.node_count());
    const StepOptions options = step_options(material, 1.0 / 60);
    if (bdf2) {
      bdf2_step(rest, mesh.tets, state, none, {}, options, kOne, scratch, bdf2_scratch);
    } else {
      implicit_euler_step(rest, mesh.tets, state, none, {}, options, kOne, scratch);
    }
    outcome.largest_kinetic = std::max(outcome.largest_kinetic, test::kinetic_energy(rest, state));
  }
  outcome.inverted = inverted_count(mesh.tets, state.x, ThreadPool(1));
  outcome.shape_error = shape_error(mesh, state.x);
  outcome.kinetic = test::kinetic_energy(rest, state);
  outcome.elastic = elastic_energy(rest, mesh.tets, state.x, state.plastic_strain);
  return outcome;
}

void expect_recovered(const Outcome& outcome) {
  EXPECT_EQ(outcome.inverted, 0);
  EXPECT_LT(outcome.shape_error, 0.01);
}

TEST(Inversion, ScrambledCubeRecovers) {
  for (unsigned seed : {1u, 2u, 3u}) {
    test::Random random(seed);
    expect_recovered(recover([&](const Vec3&) { return random.vec3(0, 1); }));
  }
}

TEST(Inversion, CubeScrambledInThreeTimesItsBoxRecovers) {
  test::Random random(4);
  expect_recovered(recover([&](const Vec3&) { return random.vec3(-1, 2); }));
}

TEST(Inversion, MirroredCubeTurnsBack) {
  expect_recovered(recover([](const Vec3& X) { return Vec3(-X.x(), X.y(), X.z()); }));
}

TEST(Inversion, CubeFlattenedToAPlaneALineOrAPointRecovers) {
  for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)}) {
    SCOPED_TRACE(scale.transpose());
    test::Random random(5);
    expect_recovered(recover([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X) + random.vec3(-1e-6, 1e-6); }));
    // Without noise all-zero F gives Q = I, and so on: as exact.
    expect_recovered(recover([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X); }));
  }
}

// Row 7. The snap back gives the body a spin that was not there (row 14: one linearisation a step does not conserve
// angular momentum), which stretches it until it fades; so: nothing inverted, nothing gained, nearly all energy gone.
TEST(Inversion, StretchOfAHundredComesBackWithoutGainingEnergy) {
  const Outcome outcome =
      recover([](const Vec3& X) { return Vec3(100 * X.x(), X.y(), X.z()); }, RotationRule::svd, 1200);
  EXPECT_EQ(outcome.inverted, 0);
  EXPECT_LT(outcome.largest_kinetic, outcome.start_elastic);
  EXPECT_LT(outcome.kinetic + outcome.elastic, 1e-4 * outcome.start_elastic);
}

TEST(Inversion, RecoveredCubeComesToRest) {
  test::Random random(6);
  const Outcome outcome = recover([&](const Vec3&) { return random.vec3(0, 1); }, RotationRule::svd, 600);
  expect_recovered(outcome);
  // Backward Euler eats the ringing; a net spin made by the scramble stays, and is no vibration.
  EXPECT_LT(outcome.kinetic, 0.05 * outcome.largest_kinetic);
}

TEST(Inversion, ByBdf2TheScrambledMirroredAndFlatCubesRecoverAsWell) {
  constexpr RotationRule kSvd = RotationRule::svd;
  for (unsigned seed : {1u, 2u, 3u}) {
    test::Random random(seed);
    expect_recovered(recover([&](const Vec3&) { return random.vec3(0, 1); }, kSvd, 120, true));
  }
  test::Random random(4);
  expect_recovered(recover([&](const Vec3&) { return random.vec3(-1, 2); }, kSvd, 120, true));
  expect_recovered(recover([](const Vec3& X) { return Vec3(-X.x(), X.y(), X.z()); }, kSvd, 120, true));
  for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)}) {
    SCOPED_TRACE(scale.transpose());
    expect_recovered(recover([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X); }, kSvd, 120, true));
  }
}

// Averages let a mirrored tet be: where one is near inversion or folded the tets of an octahedron stand for themselves.
// Bounds are wider than above: a net spin that a scramble makes stretches the body until it fades.
TEST(Inversion, SmoothedOctahedraRecoverAsWell) {
  int tried = 0, folded = 0;
  const auto recover_all = [&](const std::function<Vec3(const Vec3&)>& deform) {
    for (const TetMesh& mesh : {test::bcc_box({3, 3, 3}, {1, 1, 1}), test::kuhn_box(4, 4, 4, {1, 1, 1})}) {
      for (const bool bdf2 : {false, true}) {
        const Outcome outcome = recover(deform, RotationRule::svd, 300, bdf2, mesh, ElementKind::smoothed_octahedra);
        ++tried;
        folded += outcome.inverted > 0 || outcome.shape_error > 0.02;
      }
    }
  };
  for (unsigned seed = 1; seed <= 12; ++seed) {
    test::Random random(seed);
    recover_all([&](const Vec3&) { return random.vec3(0, 1); });
  }
  // Some find a folded shape that is at rest as well, as do plain tets: 4 of 200 cubes of 162 tets, octahedra 1 of 200.
  EXPECT_EQ(tried, 48);
  EXPECT_LE(folded, 2);
  folded = 0;
  recover_all([](const Vec3& X) { return Vec3(-X.x(), X.y(), X.z()); });
  for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)})
    recover_all([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X); });
  EXPECT_EQ(folded, 0);
}

TEST(Inversion, HexahedraRecoverAsWell) {
  int tried = 0, folded = 0;
  const auto recover_all = [&](const std::function<Vec3(const Vec3&)>& deform) {
    for (const bool bdf2 : {false, true}) {
      const Outcome outcome = recover(deform, RotationRule::svd, 300, bdf2, test::kuhn_box(4, 4, 4, {1, 1, 1}), ElementKind::hexahedra);
      ++tried;
      folded += outcome.inverted > 0 || outcome.shape_error > 0.02;
    }
  };
  for (unsigned seed = 1; seed <= 12; ++seed) {
    test::Random random(seed);
    recover_all([&](const Vec3&) { return random.vec3(0, 1); });
  }
  recover_all([](const Vec3& X) { return Vec3(-X.x(), X.y(), X.z()); });
  for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)})
    recover_all([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X); });
  EXPECT_EQ(tried, 32);
  EXPECT_EQ(folded, 0);
}

TEST(Inversion, PapersRuleRecoversTheScrambledCubeAtGameSteps) {
  test::Random random(1);
  const Outcome outcome = recover([&](const Vec3&) { return random.vec3(0, 1); }, RotationRule::polar_qr);
  EXPECT_EQ(outcome.inverted, 0);
  EXPECT_LT(outcome.shape_error, 0.05);
}

}  // namespace
}  // namespace crumple::sim::fem
