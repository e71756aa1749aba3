#include "server/sim/fem/plasticity.h"

#include "server/sim/fem/corotational.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

Mat3 from_components(const nlohmann::json& c) {  // xx, yy, zz, xy
  Mat3 m = Vec3(c[0], c[1], c[2]).asDiagonal();
  m(0, 1) = m(1, 0) = c[3];
  return m;
}

// yardstick S11: paths made by another code with the raw per-update creep.
TEST(Plasticity, PathsOfS11) {
  CRUMPLE_NEED_SHARED("yardstick/S11_plasticity_paths/paths.json");
  const auto paths = test::read_json("yardstick/S11_plasticity_paths/paths.json");
  const double E = paths["E"];
  const Lame lame = lame_constants(E, paths["nu"]);
  FemMaterial material;
  material.creep = paths["creep_per_update"];
  material.raw_creep = true;
  const double creep = creep_per_step(material, 1.0 / 250, 1.0 / 60);
  for (const auto& [name, path] : paths["tests"].items()) {
    SCOPED_TRACE(name);
    Mat3 plastic = Mat3::Zero();
    double plastic_error = 0, plastic_max = 1e-3, stress_error = 0, stress_max = 1e-3 * E;
    for (std::size_t k = 0; k < path["strain"].size(); ++k) {
      const Mat3 strain = from_components(path["strain"][k]);
      flow(strain, paths["yield_"], creep, paths["max_plastic"], plastic);
      const Mat3 stress = isotropic_stress(lame, strain - plastic);
      const Mat3 plastic_ref = from_components(path["plastic"][k]), stress_ref = from_components(path["stress"][k]);
      plastic_error = std::max(plastic_error, (plastic - plastic_ref).cwiseAbs().maxCoeff());
      plastic_max = std::max(plastic_max, plastic_ref.cwiseAbs().maxCoeff());
      stress_error = std::max(stress_error, (stress - stress_ref).cwiseAbs().maxCoeff());
      stress_max = std::max(stress_max, stress_ref.cwiseAbs().maxCoeff());
    }
    EXPECT_LT(plastic_error, 2e-9 * plastic_max);  // case.json
    EXPECT_LT(stress_error, 2e-9 * stress_max);
  }
}

// FORMULAS F18.
TEST(Plasticity, HeldStrainRelaxesTowardsYield) {
  const double y = 0.02, c = 0.3;
  const Mat3 strain = Vec3(0.05, -0.01, 0.02).asDiagonal();
  Mat3 plastic = Mat3::Zero();
  for (int k = 1; k <= 20; ++k) {
    EXPECT_TRUE(flow(strain, y, c, 10, plastic));
    EXPECT_NEAR((strain - plastic).norm(), y + (strain.norm() - y) * std::pow(1 - c, k), 1e-15);
  }
}

TEST(Plasticity, RampEndsAtTheSteadyOverstrain) {
  const double y = 0.02, c = 0.3, rate = 0.002;
  const Mat3 direction = Vec3(1, 0, 0).asDiagonal();
  Mat3 plastic = Mat3::Zero();
  double elastic = 0;
  for (int k = 1; k <= 200; ++k) {
    flow(k * rate * direction, y, c, 10, plastic);
    elastic = (k * rate * direction - plastic).norm();
  }
  EXPECT_NEAR(elastic - y, rate * (1 - c) / c, 1e-14);
}

TEST(Plasticity, BelowYieldNothingFlowsAndTheMaximumHolds) {
  Mat3 plastic = Mat3::Zero();
  EXPECT_FALSE(flow(Vec3(0.0199, 0, 0).asDiagonal(), 0.02, 1, 0.2, plastic));
  EXPECT_TRUE(plastic.isZero(0));
  EXPECT_TRUE(flow(Vec3(5, 1, -2).asDiagonal(), 0.02, 1, 0.2, plastic));
  EXPECT_NEAR(plastic.norm(), 0.2, 1e-15);
}

// STABILITY row 27, DESIGN decision 7: flow in a given time does not depend on dt; the raw form's does.
TEST(Plasticity, CreepOfAGivenTimeDoesNotDependOnTheStep) {
  FemMaterial material;
  material.creep = 0.3;
  const Mat3 strain = Vec3(0.05, -0.01, 0.02).asDiagonal();
  const auto after_one_second = [&](int steps) {
    Mat3 plastic = Mat3::Zero();
    for (int k = 0; k < steps; ++k) flow(strain, 0.02, creep_per_step(material, 1.0 / steps, 1.0 / 3), 10, plastic);
    return plastic.norm();
  };
  EXPECT_NEAR(after_one_second(60), after_one_second(30), 1e-14);
  EXPECT_NEAR(after_one_second(3), (strain.norm() - 0.02) * (1 - std::pow(0.7, 3)), 1e-14);
  material.raw_creep = true;
  EXPECT_GT(after_one_second(3), 0.01);
  EXPECT_GT(after_one_second(6), 1.2 * after_one_second(3));
}

// The force sees eps~ - eps^P: a body of plastic strain eps^P is at rest in that shape.
TEST(Plasticity, BodyStretchedBeyondYieldKeepsPartOfTheStretch) {
  const TetMesh mesh = test::regular_tet();
  FemMaterial material;
  material.yield = 0.01;
  material.creep = 0.5;
  material.max_plastic = 1;
  const RestBody rest = test::rest_body(mesh, material);
  FemState state = test::rest_state(mesh);
  for (Vec3& x : state.x) x *= 1.1;
  Elements elements;
  const ThreadPool pool(1);
  for (int k = 0; k < 100; ++k)
    plastic_flow(rest, mesh.tets, state.x, 1.0 / 60, 1.0 / 60, pool, state.plastic_strain, elements);
  // |eps^E| has relaxed to yield: eps^P = (0.1 - 0.01 / sqrt 3) I
  EXPECT_LT((state.plastic_strain[0] - (0.1 - 0.01 / std::sqrt(3.0)) * Mat3::Identity()).norm(), 1e-12);
  Eigen::VectorXd f(12);
  std::vector<Vec3> x = mesh.X;
  for (Vec3& p : x) p *= 1.1 - 0.01 / std::sqrt(3.0);
  elastic_forces(rest, mesh.tets, x, state.plastic_strain, pool, elements, f);
  EXPECT_LT(f.norm(), 1e-6 * material.young * 0.1);
  EXPECT_NEAR(elastic_energy(rest, mesh.tets, x, state.plastic_strain), 0, 1e-9);
}

}  // namespace
}  // namespace crumple::sim::fem
