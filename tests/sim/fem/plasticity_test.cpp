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
      flow(FlowRule::additive, strain, paths["yield_"], creep, paths["max_plastic"], plastic);
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
    EXPECT_TRUE(flow(FlowRule::additive, strain, y, c, 10, plastic));
    EXPECT_NEAR((strain - plastic).norm(), y + (strain.norm() - y) * std::pow(1 - c, k), 1e-15);
  }
}

TEST(Plasticity, RampEndsAtTheSteadyOverstrain) {
  const double y = 0.02, c = 0.3, rate = 0.002;
  const Mat3 direction = Vec3(1, 0, 0).asDiagonal();
  Mat3 plastic = Mat3::Zero();
  double elastic = 0;
  for (int k = 1; k <= 200; ++k) {
    flow(FlowRule::additive, k * rate * direction, y, c, 10, plastic);
    elastic = (k * rate * direction - plastic).norm();
  }
  EXPECT_NEAR(elastic - y, rate * (1 - c) / c, 1e-14);
}

TEST(Plasticity, BelowYieldNothingFlowsAndTheMaximumHolds) {
  Mat3 plastic = Mat3::Zero();
  EXPECT_FALSE(flow(FlowRule::additive, Vec3(0.0199, 0, 0).asDiagonal(), 0.02, 1, 0.2, plastic));
  EXPECT_TRUE(plastic.isZero(0));
  EXPECT_TRUE(flow(FlowRule::additive, Vec3(5, 1, -2).asDiagonal(), 0.02, 1, 0.2, plastic));
  EXPECT_NEAR(plastic.norm(), 0.2, 1e-15);
}

// STABILITY row 27, DESIGN decision 7: flow in a given time does not depend on dt; the raw form's does.
TEST(Plasticity, CreepOfAGivenTimeDoesNotDependOnTheStep) {
  FemMaterial material;
  material.creep = 0.3;
  const Mat3 strain = Vec3(0.05, -0.01, 0.02).asDiagonal();
  const auto after_one_second = [&](int steps) {
    Mat3 plastic = Mat3::Zero();
    for (int k = 0; k < steps; ++k)
      flow(FlowRule::additive, strain, 0.02, creep_per_step(material, 1.0 / steps, 1.0 / 3), 10, plastic);
    return plastic.norm();
  };
  EXPECT_NEAR(after_one_second(60), after_one_second(30), 1e-14);
  EXPECT_NEAR(after_one_second(3), (strain.norm() - 0.02) * (1 - std::pow(0.7, 3)), 1e-14);
  material.raw_creep = true;
  EXPECT_GT(after_one_second(3), 0.01);
  EXPECT_GT(after_one_second(6), 1.2 * after_one_second(3));
}

// ---- the deviatoric rule -------------------------------------------------------------------------------------------
// Closed form of von Mises' radial return (c = 1): the pressure stays, the deviator's stress is cut back to
// sqrt(2/3) sigma_y, sigma_y = sqrt(6) mu y.
TEST(DeviatoricFlow, IsVonMisesRadialReturn) {
  const double y = 0.02;
  const Lame lame = lame_constants(1e6, 0.3);
  test::Random random(4);
  int flowed = 0;
  for (int k = 0; k < 200; ++k) {
    const Mat3 strain = 0.05 * symmetric_part(random.mat3(-1, 1)) + random.uniform(-0.2, 0.2) * Mat3::Identity();
    const Mat3 trial = isotropic_stress(lame, strain);
    Mat3 plastic = Mat3::Zero();
    const bool flows = flow(FlowRule::deviatoric, strain, y, 1, 10, plastic);
    const Mat3 stress = isotropic_stress(lame, strain - plastic);
    const double sigma_y = std::sqrt(6.0) * lame.mu * y;
    EXPECT_EQ(flows, von_mises(trial) > sigma_y);
    EXPECT_NEAR(stress.trace(), trial.trace(), 1e-9 * (1 + std::abs(trial.trace())));
    if (!flows) continue;
    ++flowed;
    EXPECT_NEAR(von_mises(stress), sigma_y, 1e-9 * sigma_y);
    const Mat3 deviator = trial - trial.trace() / 3 * Mat3::Identity();
    const Mat3 expected = trial.trace() / 3 * Mat3::Identity() + std::sqrt(2.0 / 3) * sigma_y * deviator / deviator.norm();
    EXPECT_LT((stress - expected).norm(), 1e-9 * expected.norm());
    EXPECT_NEAR(plastic.trace(), 0, 1e-15);
  }
  EXPECT_GT(flowed, 50);
}

// S11's `yield_uniaxial` is the paper's rule; the other one yields at sqrt(6) mu y in any direction.
TEST(DeviatoricFlow, BarsYieldAtTheirRulesStress) {
  for (const FlowRule rule : {FlowRule::additive, FlowRule::deviatoric}) {
    FemMaterial material;
    material.young = 1e6;
    material.poisson = 0.3;
    material.yield = 0.02;
    material.flow = rule;
    const double s = yield_stress(material);
    EXPECT_NEAR(s, rule == FlowRule::additive ? 18411.49235796647 : std::sqrt(6.0) * 1e6 / 2.6 * 0.02, 1e-6);
    const auto yields_at = [&](double stress) {
      const double e = stress / material.young;
      Mat3 plastic = Mat3::Zero();
      const Mat3 strain = Vec3(-0.3 * e, e, -0.3 * e).asDiagonal();
      return flow(rule, strain, material.yield, 1, 10, plastic);
    };
    EXPECT_FALSE(yields_at(s * (1 - 1e-9)));
    EXPECT_TRUE(yields_at(s * (1 + 1e-9)));
    EXPECT_TRUE(yields_at(-s * (1 + 1e-9)));
  }
}

// A bar pulled far beyond yield, its sides free: plastic strain is -1/2 of itself across, whatever Poisson's ratio is, and
// the stress stays at sigma_y. The paper's rule keeps Poisson's ratio, which takes volume with it.
TEST(DeviatoricFlow, APulledBarKeepsItsPlasticVolume) {
  const double nu = 0.3, y = 0.02;
  const Lame lame = lame_constants(1e6, nu);
  const auto pulled = [&](FlowRule rule) {
    Mat3 plastic = Mat3::Zero();
    for (int k = 1; k <= 2000; ++k) {
      const double e = 1e-4 * k;
      // sigma_lateral = 0: lambda (e_x + 2 e_l) + 2 mu e_l = 0 of the elastic strains, iterated with the flow
      Mat3 strain = Mat3::Zero();
      for (int round = 0; round < 60; ++round) {
        const double lateral = plastic(1, 1) - nu * (e - plastic(0, 0));
        strain = Vec3(e, lateral, lateral).asDiagonal();
        flow(rule, strain, y, 1, 10, plastic);
      }
    }
    return plastic;
  };
  const Mat3 volume_kept = pulled(FlowRule::deviatoric), paper = pulled(FlowRule::additive);
  EXPECT_NEAR(volume_kept(0, 0), 0.2 - std::sqrt(6.0) * lame.mu * y / 1e6, 1e-5);  // what is left of 0.2 is elastic
  EXPECT_NEAR(volume_kept(1, 1), -0.5 * volume_kept(0, 0), 1e-9);
  EXPECT_NEAR(paper(1, 1), -nu * paper(0, 0), 1e-9);
  EXPECT_GT(paper.trace(), 0.07);
}

TEST(DeviatoricFlow, PressureAloneNeverFlowsAndTheMaximumHolds) {
  Mat3 plastic = Mat3::Zero();
  EXPECT_FALSE(flow(FlowRule::deviatoric, 0.9 * Mat3::Identity(), 0.001, 1, 0.2, plastic));
  EXPECT_FALSE(flow(FlowRule::deviatoric, -0.9 * Mat3::Identity(), 0.001, 1, 0.2, plastic));
  EXPECT_TRUE(flow(FlowRule::additive, 0.9 * Mat3::Identity(), 0.001, 1, 10, plastic));
  plastic.setZero();
  EXPECT_TRUE(flow(FlowRule::deviatoric, Vec3(5, 1, -2).asDiagonal(), 0.02, 1, 0.2, plastic));
  EXPECT_NEAR(plastic.norm(), 0.2, 1e-15);
  EXPECT_NEAR(plastic.trace(), 0, 1e-15);
}

// F18 with the deviator in the place of the strain.
TEST(DeviatoricFlow, RelaxesRampsAndDoesNotDependOnTheStep) {
  const double y = 0.02, c = 0.3;
  const Mat3 strain = Vec3(0.06, -0.02, 0.05).asDiagonal();  // 0.03 of it is the mean
  const Mat3 deviator = strain - 0.03 * Mat3::Identity();
  Mat3 plastic = Mat3::Zero();
  for (int k = 1; k <= 20; ++k) {
    flow(FlowRule::deviatoric, strain, y, c, 10, plastic);
    EXPECT_NEAR((deviator - plastic).norm(), y + (deviator.norm() - y) * std::pow(1 - c, k), 1e-15);
  }
  const double rate = 0.002;
  const Mat3 direction = Vec3(1, 0, 0).asDiagonal(), ramp = direction - Mat3::Identity() / 3;
  plastic.setZero();
  double elastic = 0;
  for (int k = 1; k <= 200; ++k) {
    flow(FlowRule::deviatoric, k * rate * direction, y, c, 10, plastic);
    elastic = (k * rate * ramp - plastic).norm();
  }
  EXPECT_NEAR(elastic - y, rate * ramp.norm() * (1 - c) / c, 1e-14);

  FemMaterial material;
  material.creep = c;
  const auto after_one_second = [&](int steps) {
    Mat3 flowed = Mat3::Zero();
    for (int k = 0; k < steps; ++k)
      flow(FlowRule::deviatoric, strain, y, creep_per_step(material, 1.0 / steps, 1.0 / 3), 10, flowed);
    return flowed.norm();
  };
  EXPECT_NEAR(after_one_second(60), after_one_second(30), 1e-14);
  EXPECT_NEAR(after_one_second(3), (deviator.norm() - y) * (1 - std::pow(1 - c, 3)), 1e-14);
}

// A tet blown up and sheared: what flows is the shear.
TEST(DeviatoricFlow, ABodyUsesTheRuleOfItsMaterial) {
  const TetMesh mesh = test::regular_tet();
  FemMaterial material;
  material.yield = 0.01;
  material.creep = 1;
  material.flow = FlowRule::deviatoric;
  const RestBody rest = test::rest_body(mesh, material);
  FemState state = test::rest_state(mesh);
  for (Vec3& x : state.x) x *= 1.1;
  Elements elements;
  const ThreadPool pool(1);
  plastic_flow(rest, mesh.tets, state.x, 1.0 / 60, 1.0 / 60, pool, state.plastic_strain, elements);
  EXPECT_TRUE(state.plastic_strain[0].isZero(1e-15));
  for (Vec3& x : state.x) x.x() *= 1.2;
  plastic_flow(rest, mesh.tets, state.x, 1.0 / 60, 1.0 / 60, pool, state.plastic_strain, elements);
  const Mat3 deviator = 0.22 * (Vec3(1, 0, 0).asDiagonal().toDenseMatrix() - Mat3::Identity() / 3);
  EXPECT_LT((state.plastic_strain[0] - (1 - 0.01 / deviator.norm()) * deviator).norm(), 1e-12);
}

// ---- the moment of plastic strain that is not coaxial ---------------------------------------------------------------
Mat3 random_plastic(test::Random& random) {
  const Mat3 strain = symmetric_part(random.mat3(-0.3, 0.3));
  return strain - strain.trace() / 3 * Mat3::Identity();
}

TEST(MomentBalance, MakesStressTimesStretchSymmetricAndIsZeroWhereItIsAlready) {
  test::Random random(8);
  const Lame lame = lame_constants(1e6, 0.3);
  for (int k = 0; k < 100; ++k) {
    const Mat3 S = Mat3::Identity() + symmetric_part(random.mat3(-0.3, 0.3));
    const Mat3 sigma = isotropic_stress(lame, S - Mat3::Identity() - random_plastic(random));
    const Mat3 A = moment_balance(S, sigma);
    EXPECT_LT((A + A.transpose()).norm(), 1e-9);
    const Mat3 balanced = (sigma + A) * S;
    EXPECT_LT((balanced - balanced.transpose()).norm(), 1e-12 * balanced.norm());
    EXPECT_LT(moment_balance(S, isotropic_stress(lame, S - Mat3::Identity())).norm(), 1e-9);
  }
  // Squashed to nothing or inverted: no larger than the stress.
  for (int k = 0; k < 100; ++k) {
    const Mat3 R = random.rotation();
    const Vec3 stretch(random.uniform(0, 1), random.uniform(0, 0.1), random.uniform(-1, 0.1));
    const Mat3 S = R * stretch.asDiagonal() * R.transpose();
    const Mat3 sigma = isotropic_stress(lame, S - Mat3::Identity() - random_plastic(random));
    EXPECT_LT(moment_balance(S, sigma).norm(), 4 * sigma.norm());
  }
}

// F4's second half: with the balance the element's forces are -dE/dx and have no moment also once it has flowed.
TEST(MomentBalance, ForcesOfTheDeviatoricRuleAreMinusTheEnergysGradient) {
  test::Random random(9);
  const TetMesh mesh = test::regular_tet();
  FemMaterial material;
  material.flow = FlowRule::deviatoric;
  const RestBody rest = test::rest_body(mesh, material);
  material.flow = FlowRule::additive;
  const RestBody paper = test::rest_body(mesh, material);
  const ThreadPool pool(1);
  Elements elements;
  Eigen::VectorXd f(12);
  double papers_moment = 0;
  for (int round = 0; round < 50; ++round) {
    FemState state = test::rest_state(mesh);
    state.plastic_strain[0] = random_plastic(random);
    const Mat3 R = random.rotation();
    for (Vec3& x : state.x) x = R * x + random.vec3(-0.3, 0.3);
    const auto moment = [&] {
      Vec3 sum = Vec3::Zero();
      for (int a = 0; a < 4; ++a) sum += state.x[a].cross(f.segment<3>(3 * a));
      return sum.norm() / f.norm();
    };
    elastic_forces(paper, mesh.tets, state.x, state.plastic_strain, pool, elements, f);
    papers_moment = std::max(papers_moment, moment());
    elastic_forces(rest, mesh.tets, state.x, state.plastic_strain, pool, elements, f);
    EXPECT_LT(moment(), 1e-12);
    constexpr double h = 1e-6;
    for (int k = 0; k < 12; ++k) {
      std::vector<Vec3> plus = state.x, minus = state.x;
      plus[k / 3][k % 3] += h;
      minus[k / 3][k % 3] -= h;
      const double gradient = (elastic_energy(rest, mesh.tets, plus, state.plastic_strain) -
                               elastic_energy(rest, mesh.tets, minus, state.plastic_strain)) / (2 * h);
      EXPECT_NEAR(f[k], -gradient, 1e-6 * f.norm());
    }
  }
  EXPECT_GT(papers_moment, 0.05);
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
