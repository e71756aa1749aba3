// The thirteen reference cases, each through the library as a user's program calls it, at the tolerance that its
// case.json states. Fields `ccx_*` are CalculiX's, `own_corotational_*` an independent Newton code's, `exact_*` closed forms.
#include "server/lab/material_replay.h"
#include "server/lab/static_solve.h"
#include "server/lab/trajectory.h"
#include "server/lab/vibration_modes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/shared_data.h"

namespace crumple::lab {
namespace {

constexpr double kSameMesh = 1e-5;  // the references store 7 digits

std::filesystem::path case_dir(const std::string& name) { return test::shared_data("yardstick/" + name); }

Json scalars(const std::string& name) { return (*read_json(case_dir(name) / "case.json"))["scalars"]; }

struct Solved {
  Level level;
  StaticSolution solution;
  Json reference;  // the level file's `solutions`

  // |u - u_ref|_2 / |u_ref|_2 over all nodes, as the collection's own score.
  double relative_l2(const std::string& field) const {
    double difference = 0, size = 0;
    const Json& rows = reference.at(field);
    EXPECT_EQ(rows.size(), solution.displacements.size());
    for (std::size_t n = 0; n < rows.size(); ++n) {
      const Vec3 ref(rows[n][0], rows[n][1], rows[n][2]);
      difference += (solution.displacements[n] - ref).squaredNorm();
      size += ref.squaredNorm();
    }
    return std::sqrt(difference / size);
  }

  // Of the reactions of the nodes on x = 1, about the axis through (y, z) = (0.1, 0.1), where they act: at the rest
  // positions in a linear solution, else at the displaced ones [N m].
  double torque_at_end(Model model) const {
    double torque = 0;
    for (std::size_t n = 0; n < level.mesh.X.size(); ++n) {
      if (level.mesh.X[n].x() < 1 - 1e-9) continue;
      Vec3 arm = level.mesh.X[n] - Vec3(0, 0.1, 0.1);
      if (model == Model::corotational) arm += solution.displacements[n];
      torque += arm.cross(solution.reactions[n]).x();
    }
    return torque;
  }
};

Solved solve(const std::string& name, const std::string& level_name, Model model, Precision precision = Precision::double_,
             MaterialOverride override = {}) {
  Solved solved;
  auto level = read_level(case_dir(name), level_name);
  auto material = read_material(case_dir(name), override);
  EXPECT_TRUE(level) << level.error().text();
  EXPECT_TRUE(material) << material.error().text();
  if (!level || !material) return solved;
  auto solution = solve_static(*level, *material, model, precision);
  EXPECT_TRUE(solution) << solution.error().text();
  if (!solution) return solved;
  EXPECT_TRUE(solution->converged) << name << " " << level_name << ": residual " << solution->residual;
  solved.level = std::move(*level);
  solved.solution = std::move(*solution);
  solved.reference = (*read_json(case_dir(name) / (level_name + ".json")))["solutions"];
  return solved;
}

TEST(Yardstick, S01PatchTestIsExactInBothPrecisionsAndModels) {
  CRUMPLE_NEED_SHARED("yardstick/S01_patch_test");
  const std::string name = "S01_patch_test";
  EXPECT_LT(solve(name, "L0", Model::linear).relative_l2("exact"), 1e-9);
  EXPECT_LT(solve(name, "L0", Model::linear).relative_l2("ccx_c3d4_linear"), 2e-7);
  EXPECT_LT(solve(name, "L0", Model::linear, Precision::single).relative_l2("exact"), 1e-4);
  // u = A x + b is an equilibrium of the corotational model, too: its stress is uniform.
  EXPECT_LT(solve(name, "L0", Model::corotational).relative_l2("exact"), 1e-9);
  // The supports hold the body and nothing else: their forces cancel.
  Vec3 sum = Vec3::Zero();
  double largest = 0;
  for (const Vec3& r : solve(name, "L0", Model::linear).solution.reactions) {
    sum += r;
    largest = std::max(largest, r.norm());
  }
  EXPECT_GT(largest, 1);
  EXPECT_LT(sum.norm(), 1e-9 * largest);
}

TEST(Yardstick, S02BarStretchesByTheTractionOverEAtAnyLoad) {
  CRUMPLE_NEED_SHARED("yardstick/S02_uniaxial_tension");
  const Solved small = solve("S02_uniaxial_tension", "L0", Model::linear);
  EXPECT_LT(small.relative_l2("exact"), 1e-6);
  EXPECT_LT(small.relative_l2("ccx_c3d4_linear"), 1e-6);
  EXPECT_LT(solve("S02_uniaxial_tension", "L0_x30", Model::corotational).relative_l2("exact_corotational"), 1e-6);
}

TEST(Yardstick, S03CantileverBendsLikeCalculix) {
  CRUMPLE_NEED_SHARED("yardstick/S03_cantilever_small");
  for (const char* level : {"L0", "L1"}) {
    EXPECT_LT(solve("S03_cantilever_small", level, Model::linear).relative_l2("ccx_c3d4_linear"), kSameMesh) << level;
  }
}

// On the collection's own meshes, which are no lattices: S03's error of 33 % becomes 6.3, S09's 19 becomes 12, S13's 2.1
// becomes 0.55, the first frequency's 28 becomes 4.0.
TEST(Yardstick, SmoothedOctahedraAreCloserToQuadraticTetsAndClosedForms) {
  CRUMPLE_NEED_SHARED("yardstick/S03_cantilever_small");
  const MaterialOverride smoothed{.element = sim::fem::ElementKind::smoothed_octahedra};
  const auto error = [&](const std::string& name, const std::string& level, const std::string& field, const MaterialOverride& override) {
    return solve(name, level, Model::linear, Precision::double_, override).relative_l2(field);
  };
  EXPECT_LT(error("S01_patch_test", "L0", "exact", smoothed), 1e-9);
  struct Row {
    const char *name, *level, *field;
    double share;  // of plain tets' error
  };
  for (const auto& [name, level, field, share] : {Row{"S03_cantilever_small", "L0", "ref_c3d10_at_nodes", 0.45}, Row{"S03_cantilever_small", "L1", "ref_c3d10_at_nodes", 0.2},
                                                  Row{"S06_thick_sphere_pressure", "L1", "exact_lame", 0.75}, Row{"S09_bunny_hung", "L0", "ref_c3d10_L1_linear", 0.75},
                                                  Row{"S13_thick_cylinder_pressure", "L1", "exact_lame", 0.3}}) {
    EXPECT_LT(error(name, level, field, smoothed), share * error(name, level, field, {})) << name << " " << level;
  }
  auto level = read_level(case_dir("S07_cantilever_frequencies"), "L1");
  auto material = read_material(case_dir("S07_cantilever_frequencies"), smoothed);
  ASSERT_TRUE(level && material);
  const auto hertz = natural_frequencies(*level, *material, 2);
  ASSERT_TRUE(hertz);
  EXPECT_NEAR((*hertz)[0], 0.9692404, 0.045 * 0.9692404);  // Euler-Bernoulli's, 0.5 % above Timoshenko's
}

// The collection's lattices and its mapped shapes are cells of six tets. S03's errors of 65 and 33 % become 1.3 and 0.5 %.
TEST(Yardstick, HexahedraHaveASmallPartOfTetsErrorInBendingTwistingAndNearlyIncompressible) {
  CRUMPLE_NEED_SHARED("yardstick/S03_cantilever_small");
  const MaterialOverride hexahedra{.element = sim::fem::ElementKind::hexahedra};
  const auto error = [&](const std::string& name, const std::string& level, const std::string& field, const MaterialOverride& override) {
    return solve(name, level, Model::linear, Precision::double_, override).relative_l2(field);
  };
  EXPECT_LT(error("S01_patch_test", "L0", "exact", hexahedra), 1e-9);
  struct Row {
    const char *name, *level, *field;
    double share;  // of plain tets' error
  };
  for (const auto& [name, level, field, share] : {Row{"S03_cantilever_small", "L0", "ref_c3d10_at_nodes", 0.05}, Row{"S03_cantilever_small", "L1", "ref_c3d10_at_nodes", 0.05},
                                                  Row{"S06_thick_sphere_pressure", "L1", "exact_lame", 0.5}, Row{"S13_thick_cylinder_pressure", "L1", "exact_lame", 0.4}}) {
    EXPECT_LT(error(name, level, field, hexahedra), share * error(name, level, field, {})) << name << " " << level;
  }
}

TEST(Yardstick, S03SupportsCarryTheLoad) {
  CRUMPLE_NEED_SHARED("yardstick/S03_cantilever_small");
  for (const Model model : {Model::linear, Model::corotational}) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& r : solve("S03_cantilever_small", "L0", model).solution.reactions) sum += r;
    EXPECT_LT((sum - Vec3(0, 0, 0.25)).norm(), 1e-9) << sum.transpose();
  }
}

TEST(Yardstick, S04LargeDeflectionAgreesWithTheIndependentCorotationalCode) {
  CRUMPLE_NEED_SHARED("yardstick/S04_elastica_large_deflection");
  const Solved coarse = solve("S04_elastica_large_deflection", "L0", Model::corotational);
  EXPECT_LT(coarse.relative_l2("own_corotational_static"), kSameMesh);
  // CalculiX has St. Venant-Kirchhoff there; the case states the gap between the two models.
  EXPECT_NEAR(coarse.relative_l2("ccx_c3d4_nlgeom"), scalars("S04_elastica_large_deflection")["corot_vs_ccx_relL2_L0"].get<double>(), 1e-4);
}

TEST(Yardstick, S05TwistedBarReactsWithTheTorqueOfTheReferences) {
  CRUMPLE_NEED_SHARED("yardstick/S05_torsion_square_bar");
  const std::string name = "S05_torsion_square_bar";
  const Json ref = scalars(name);
  for (const char* level : {"L0", "L1"}) {
    const Solved small = solve(name, level, Model::linear);
    EXPECT_LT(small.relative_l2("ccx_c3d4_linear_theta0p01"), kSameMesh) << level;
    const double torque = ref[std::string("ccx_c3d4_") + level];
    EXPECT_NEAR(small.torque_at_end(Model::linear), torque, kSameMesh * torque) << level;
  }
  const Solved finite = solve(name, "L0_45deg", Model::corotational);
  EXPECT_LT(finite.relative_l2("own_corotational_static"), kSameMesh);
  const double torque = ref["own_corot_45deg_torque_L0"];
  EXPECT_NEAR(finite.torque_at_end(Model::corotational), torque, kSameMesh * torque);
}

TEST(Yardstick, S06SphereUnderPressureSwellsLikeCalculixAndTowardsLame) {
  CRUMPLE_NEED_SHARED("yardstick/S06_thick_sphere_pressure");
  const Solved coarse = solve("S06_thick_sphere_pressure", "L0", Model::linear);
  const Solved fine = solve("S06_thick_sphere_pressure", "L1", Model::linear);
  EXPECT_LT(coarse.relative_l2("ccx_c3d4_linear"), kSameMesh);
  EXPECT_LT(fine.relative_l2("ccx_c3d4_linear"), kSameMesh);
  const Json ref = scalars("S06_thick_sphere_pressure");
  EXPECT_NEAR(coarse.relative_l2("exact_lame"), ref["ccx_c3d4_L0_relL2_vs_lame"].get<double>(), 1e-5);
  EXPECT_NEAR(fine.relative_l2("exact_lame"), ref["ccx_c3d4_L1_relL2_vs_lame"].get<double>(), 1e-5);
}

TEST(Yardstick, S07FrequenciesAreThoseOfTheLumpedMass) {
  CRUMPLE_NEED_SHARED("yardstick/S07_cantilever_frequencies");
  const auto material = read_material(case_dir("S07_cantilever_frequencies"), {});
  ASSERT_TRUE(material);
  for (const char* name : {"L0", "L1"}) {
    const auto level = read_level(case_dir("S07_cantilever_frequencies"), name);
    ASSERT_TRUE(level) << level.error().text();
    const Json ref = scalars("S07_cantilever_frequencies")[name]["own_lumped_mass_Hz"];
    const auto hz = natural_frequencies(*level, *material, static_cast<int>(ref.size()));
    ASSERT_TRUE(hz) << hz.error().text();
    for (std::size_t k = 0; k < ref.size(); ++k) EXPECT_NEAR((*hz)[k], ref[k], 1e-4 * ref[k].get<double>()) << name << " mode " << k;
  }
}

TEST(Yardstick, S07FreeBodyHasSixRigidModes) {
  CRUMPLE_NEED_SHARED("yardstick/S07_cantilever_frequencies");
  const auto material = read_material(case_dir("S07_cantilever_frequencies"), {});
  auto level = read_level(case_dir("S07_cantilever_frequencies"), "L0");
  ASSERT_TRUE(material && level);
  level->dirichlet.clear();
  const auto hz = natural_frequencies(*level, *material, 8);
  ASSERT_TRUE(hz) << hz.error().text();
  for (int k = 0; k < 6; ++k) EXPECT_EQ((*hz)[k], 0) << k;
  EXPECT_GT((*hz)[6], 1);
}

TEST(Yardstick, S08PointStatesAgreeWithTheClosedForms) {
  CRUMPLE_NEED_SHARED("yardstick/S08_simple_shear_and_point_states");
  const auto report = replay_material(case_dir("S08_simple_shear_and_point_states"));
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_EQ(report->by_test.size(), 23u);
  EXPECT_LT(report->max_relative_error, 1e-10);
}

TEST(Yardstick, S09BunnyHangsLikeCalculixAndTheIndependentCorotationalCode) {
  CRUMPLE_NEED_SHARED("yardstick/S09_bunny_hung");
  EXPECT_LT(solve("S09_bunny_hung", "L0", Model::linear).relative_l2("ccx_c3d4_linear"), kSameMesh);
  EXPECT_LT(solve("S09_bunny_hung", "L0", Model::corotational).relative_l2("own_corotational_static"), 1e-4);
}

TEST(Yardstick, S10CookMembraneLocksLikeCalculixAtEveryPoissonRatio) {
  CRUMPLE_NEED_SHARED("yardstick/S10_cook_membrane_nu");
  for (const char* level : {"L0", "L1"}) {
    for (const auto& [nu, tolerance] : {std::pair{"0.3", kSameMesh}, {"0.49", kSameMesh}, {"0.4999", 1e-4}}) {
      const Solved solved = solve("S10_cook_membrane_nu", level, Model::linear, Precision::double_, {.poisson = std::stod(nu)});
      EXPECT_LT(solved.relative_l2(std::string("ccx_c3d4_nu") + nu), tolerance) << level << " nu " << nu;
    }
  }
  // Three ratios stand in the case: somebody has to choose.
  const auto material = read_material(case_dir("S10_cook_membrane_nu"), {});
  ASSERT_FALSE(material);
  EXPECT_NE(material.error().text().find("material.nu is a list"), std::string::npos) << material.error().text();
}

// The tip over what CalculiX's quadratic tets have, 32 cells across. Tets miss it by 61 and 45 % at nu = 0.49, 73 and 72 % at 0.4999,
// octahedra, whose pressure is kept in patches, by 19 and 6.9, 19 and 6.6 %.
TEST(Yardstick, S10NearlyIncompressibleOctahedraMissByAThirdOfWhatTetsDo) {
  CRUMPLE_NEED_SHARED("yardstick/S10_cook_membrane_nu");
  const auto scalars = (*read_json(case_dir("S10_cook_membrane_nu") / "case.json"))["scalars"];
  for (const char* level : {"L0", "L1"}) {
    for (const std::string nu : {"0.49", "0.4999"}) {
      const double exact = scalars["c3d10_32_nu" + nu];
      const auto miss = [&](sim::fem::ElementKind element) {
        const Solved solved = solve("S10_cook_membrane_nu", level, Model::linear, Precision::double_, {.poisson = std::stod(nu), .element = element});
        const auto tip = std::ranges::find_if(solved.level.mesh.X, [](const Vec3& X) { return (X - Vec3(48, 60, 0)).norm() < 1e-9; });
        return 1 - solved.solution.displacements[tip - solved.level.mesh.X.begin()].y() / exact;
      };
      const double octahedra = miss(sim::fem::ElementKind::smoothed_octahedra);
      EXPECT_GT(octahedra, 0) << level << " nu " << nu;
      EXPECT_LT(octahedra, miss(sim::fem::ElementKind::linear_tetrahedra) / 3) << level << " nu " << nu;
    }
  }
}

TEST(Yardstick, S11PlasticFlowFollowsEveryPath) {
  CRUMPLE_NEED_SHARED("yardstick/S11_plasticity_paths");
  const auto report = replay_material(case_dir("S11_plasticity_paths"));
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_EQ(report->by_test.size(), 7u);
  EXPECT_LT(report->max_relative_error, 2e-9);
}

// The cycle in pure shear that the case checked against CalculiX's von Mises plasticity.
TEST(Yardstick, S11DeviatoricFlowGivesCalculixsJ2Answer) {
  CRUMPLE_NEED_SHARED("yardstick/S11_plasticity_paths");
  const auto report = replay_material(case_dir("S11_plasticity_paths"));
  ASSERT_TRUE(report) << report.error().text();
  ASSERT_TRUE(report->by_test.contains("j2_check deviatoric") && report->j2_calculix);
  EXPECT_LT(report->by_test.at("j2_check additive"), 2e-9);
  EXPECT_LT(report->by_test.at("j2_check deviatoric"), 2e-9);
  EXPECT_LT(*report->j2_calculix, 5e-7);  // seven digits are stored
}

// Largest difference over the run to a reference of the same times, over the reference's largest value.
double relative_error(const std::vector<double>& got, const std::vector<double>& ref) {
  EXPECT_EQ(got.size(), ref.size());
  double difference = 0, size = 0;
  for (std::size_t k = 0; k < ref.size(); ++k) {
    difference = std::max(difference, std::abs(got[k] - ref[k]));
    size = std::max(size, std::abs(ref[k]));
  }
  return difference / size;
}

// What two runs, one with half the other's step, promise for a step of zero if the error is of first order.
std::vector<double> extrapolated(const std::vector<double>& coarse, const std::vector<double>& fine) {
  std::vector<double> limit;
  for (std::size_t k = 0; k < fine.size(); ++k) limit.push_back(2 * fine[k] - coarse[k]);
  return limit;
}

Trajectory run_s12(const std::string& run, double dt, int substeps, const std::string& integrator = "backward_euler") {
  auto trajectory = run_trajectory(case_dir("S12_dynamics_step_load"), run, dt, substeps, integrator, {});
  EXPECT_TRUE(trajectory) << trajectory.error().text();
  return trajectory ? *trajectory : Trajectory{};
}

TEST(Yardstick, S12StepLoadConvergesToTheModalSolutionInFirstOrder) {
  CRUMPLE_NEED_SHARED("yardstick/S12_dynamics_step_load");
  const Json reference = *read_json(case_dir("S12_dynamics_step_load") / "linear_lumped_tip.json");
  const auto ref = reference["tip_uz"].get<std::vector<double>>();
  const Trajectory coarse = run_s12("step", 1.0 / 120, 32), fine = run_s12("step", 1.0 / 120, 64);
  EXPECT_LT(relative_error(fine.times, reference["t"].get<std::vector<double>>()), 1e-9);
  const double coarse_error = relative_error(coarse.tip_uz, ref), fine_error = relative_error(fine.tip_uz, ref);
  EXPECT_LT(fine_error, 0.01);
  // The jump of the load sets off modes that these steps damp out altogether; their part does not halve yet.
  EXPECT_NEAR(coarse_error / fine_error, 2, 0.25);
  EXPECT_LT(relative_error(extrapolated(coarse.tip_uz, fine.tip_uz), ref), 0.3 * fine_error);
}

TEST(Yardstick, S12SwingConvergesToTheIndependentRunInFirstOrder) {
  CRUMPLE_NEED_SHARED("yardstick/S12_dynamics_step_load");
  const Json reference = *read_json(case_dir("S12_dynamics_step_load") / "corot_swing.json");
  const auto component = [](const std::vector<Vec3>& x, int k) {
    std::vector<double> values;
    for (const Vec3& p : x) values.push_back(p[k]);
    return values;
  };
  std::vector<double> ref_z;
  for (const Json& p : reference["tip"]) ref_z.push_back(p[2]);
  const Trajectory coarse = run_s12("swing", 1.0 / 60, 8), fine = run_s12("swing", 1.0 / 60, 16);
  const auto coarse_z = component(coarse.tip, 2), fine_z = component(fine.tip, 2);
  const double coarse_error = relative_error(coarse_z, ref_z), fine_error = relative_error(fine_z, ref_z);
  EXPECT_LT(fine_error, 0.05);
  EXPECT_NEAR(coarse_error / fine_error, 2, 0.3);
  EXPECT_LT(relative_error(extrapolated(coarse_z, fine_z), ref_z), 0.2 * fine_error);

  // Whole shapes at the named times: the same convergence.
  ASSERT_EQ(fine.snapshots.size(), reference["snapshots"].size());
  for (const auto& [time, x] : fine.snapshots) {
    const Json& ref = reference["snapshots"][time == 1 ? "1.0" : Json(time).dump()];
    ASSERT_EQ(ref.size(), x.size());
    double worst = 0;
    for (std::size_t n = 0; n < x.size(); ++n) worst = std::max(worst, (x[n] - Vec3(ref[n][0], ref[n][1], ref[n][2])).norm());
    EXPECT_LT(worst, 0.05) << time;  // of a beam 1 m long
  }

  // Nothing drives the swing: its energy starts where the reference's does and only falls.
  EXPECT_NEAR(fine.energy.front(), reference["energy"][0].get<double>(), 1e-6);
  for (std::size_t k = 1; k < fine.energy.size(); ++k) EXPECT_LE(fine.energy[k], fine.energy[k - 1] + 1e-9) << k;
  EXPECT_GT(fine.energy.back(), coarse.energy.back());
  EXPECT_EQ(fine.momentum.front(), Vec3::Zero());
  EXPECT_EQ(fine.angular_momentum.front(), Vec3::Zero());
  EXPECT_LT(fine.momentum[6].z(), -0.1);        // it falls ...
  EXPECT_GT(fine.angular_momentum[6].y(), 0.1); // ... and turns about y
}

// The reference is known to 3e-6.
TEST(Yardstick, S12SwingByBdf2IsFiveTimesNearerAndConvergesFaster) {
  CRUMPLE_NEED_SHARED("yardstick/S12_dynamics_step_load");
  const Json reference = *read_json(case_dir("S12_dynamics_step_load") / "corot_swing.json");
  const auto rms_error = [&](const Trajectory& run) {
    double error = 0, size = 0;
    EXPECT_EQ(run.tip.size(), reference["tip"].size());
    for (std::size_t k = 0; k < run.tip.size(); ++k) {
      const Json& p = reference["tip"][k];
      const Vec3 ref(p[0], p[1], p[2]);
      error += (run.tip[k] - ref).squaredNorm();
      size += (ref - run.tip[0]).squaredNorm();
    }
    return std::sqrt(error / size);
  };
  const double at_60 = rms_error(run_s12("swing", 1.0 / 60, 1, "bdf2")), at_240 = rms_error(run_s12("swing", 1.0 / 60, 4, "bdf2")),
               at_480 = rms_error(run_s12("swing", 1.0 / 60, 8, "bdf2")), at_960 = rms_error(run_s12("swing", 1.0 / 60, 16, "bdf2"));
  EXPECT_LT(at_60, 0.04);
  EXPECT_GT(rms_error(run_s12("swing", 1.0 / 60, 1)), 5 * at_60);
  // Its highest modes, which these steps damp out, keep the order below two: 1.59, 1.65, and 1.75 at 1/1920.
  EXPECT_GT(std::log2(at_240 / at_480), 1.5);
  EXPECT_GT(std::log2(at_480 / at_960), 1.6);
}

TEST(Yardstick, S13CylinderUnderPressureSwellsLikeCalculixAndTowardsLame) {
  CRUMPLE_NEED_SHARED("yardstick/S13_thick_cylinder_pressure");
  const Json ref = scalars("S13_thick_cylinder_pressure");
  for (const char* level : {"L0", "L1"}) {
    const Solved solved = solve("S13_thick_cylinder_pressure", level, Model::linear);
    EXPECT_LT(solved.relative_l2("ccx_c3d4_linear"), kSameMesh) << level;
    const double to_lame = ref[std::string("ccx_c3d4_") + level + "_relL2_vs_lame"];
    EXPECT_NEAR(solved.relative_l2("exact_lame"), to_lame, 1e-5) << level;
  }
}

}  // namespace
}  // namespace crumple::lab
