// crumple-lab as a program: one JSON object on its standard output, its exit codes, its benchmark's keys.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/child_process.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace crumple {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

struct Ran {
  int exit_code = -1;
  std::string line;   // the first of its standard output
  std::string more;   // the second: nothing may stand there
  Json json() const { return Json::parse(line, nullptr, false); }
};

Ran lab(Words words) {
  words.insert(words.begin(), test::program("crumple-lab"));
  test::ChildProcess child(words);
  EXPECT_TRUE(child.started());
  Ran ran;
  ran.line = child.read_line();
  ran.more = child.read_line();
  ran.exit_code = child.wait();
  return ran;
}

constexpr const char* kCase = R"({"material": {"E": 1e6, "nu": 0.25, "rho": 1000},
  "runs": {"fall": {"level": "free", "model": "corotational", "gravity": [0, 0, -9.81], "end": 0.5, "snapshots": [0.25, 0.5]}}})";
// One tet whose base stands still and whose top is pulled up.
constexpr const char* kHeld = R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,3]],
  "dirichlet": [[0,0,0],[0,1,0],[0,2,0],[1,0,0],[1,1,0],[1,2,0],[2,0,0],[2,1,0],[2,2,0]], "loads": [[3,0,0,1000]]})";
constexpr const char* kFree = R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,3]], "sets": {"tip": [3]},
  "initial_velocity": [[1,0,0],[1,0,0],[1,0,0],[1,0,0]], "loads": [[3,0,0,1000]]})";

// A folder of the collection's form that is not of the collection.
class LabProgram : public testing::Test {
 protected:
  LabProgram() {
    folder_.write("case.json", kCase);
    folder_.write("held.json", kHeld);
    folder_.write("free.json", kFree);
  }
  std::string dir() const { return folder_.path().string(); }
  test::TemporaryFolder folder_;
};

TEST_F(LabProgram, SolvesAnyFolderOfTheForm) {
  // u_z of the top: uniform strain e_zz = u, F = (2 mu + lambda) u A_eff; a corner's force is stress times V per height:
  // (2 mu + lambda) u V = 1000, V = 1/6, mu = lambda = 4e5.
  const double u = 1000 / (3 * 4e5 / 6);
  for (const char* model : {"linear", "corotational"}) {
    const Ran ran = lab({"solve", dir(), "held", "--model", model});
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_EQ(ran.more, "");
    const Json json = ran.json();
    ASSERT_EQ(json["displacements"].size(), 4u) << ran.line;
    EXPECT_NEAR(json["displacements"][3][2].get<double>(), u, 1e-9 * u);
    double up = 0;
    for (const Json& r : json["reactions"]) up += r[2].get<double>();
    EXPECT_NEAR(up, -1000, 1e-6);
  }
}

TEST_F(LabProgram, WritesTheResultWhereItIsTold) {
  const Ran ran = lab({"solve", dir(), "held", "--out", dir() + "/result.json", "--precision", "float"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_TRUE(ran.json()["converged"].get<bool>()) << ran.line;
  std::ifstream in(dir() + "/result.json");
  EXPECT_EQ(Json::parse(in, nullptr, false)["reactions"].size(), 4u);
  EXPECT_EQ(lab({"solve", dir(), "held", "--out", dir() + "/no/such/folder.json"}).exit_code, 2);
}

TEST_F(LabProgram, OverridesTheMaterial) {
  const Json soft = lab({"solve", dir(), "held"}).json(), stiff = lab({"solve", dir(), "held", "--young", "2e6"}).json();
  EXPECT_NEAR(soft["displacements"][3][2].get<double>(), 2 * stiff["displacements"][3][2].get<double>(), 1e-12);
}

TEST_F(LabProgram, ExitsWithThreeAndTheResidualWhereNothingHoldsTheBody) {
  const Ran ran = lab({"solve", dir(), "free"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_FALSE(ran.json()["converged"].get<bool>()) << ran.line;
  EXPECT_GT(ran.json()["residual"].get<double>(), 1e-10);
  EXPECT_EQ(lab({"solve", dir(), "free", "--model", "linear"}).exit_code, 3);
}

TEST_F(LabProgram, ExitsWithTwoOnBadInput) {
  folder_.write("cut.json", "{\"nodes\": [[0,0,0]");
  folder_.write("text.json", R"({"nodes": [["a",0,0]], "tets": []})");
  folder_.write("range.json", R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,4]]})");
  folder_.write("inverted.json", R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[1,0,2,3]]})");
  folder_.write("supports.json", R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,3]], "dirichlet": {"a": 1}})");
  folder_.write("tip.json", R"({"nodes": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,3]], "sets": {"tip": {"a": 1}}})");
  folder_.write("list.json", "[]");
  folder_.write("b/case.json", R"({"material": {"E": 1e6, "nu": [0.3, 0.4], "rho": 1}})");
  folder_.write("b/held.json", kHeld);
  folder_.write("c/case.json", "[1, 2]");
  folder_.write("c/held.json", kHeld);
  folder_.write("d/case.json", "{\"material\": ");
  folder_.write("d/held.json", kHeld);
  folder_.write("e/case.json", kCase);
  folder_.write("e/states.json", R"([{"F": [[1,0,0],[0,1,0],[0,0,1]]}])");
  folder_.write("f/case.json", R"({"material": {"E": 1e6, "nu": 0.3, "rho": 1}, "runs": {"r": {"level": "held", "model": "linear", "end": 1, "snapshots": {"a": 1}}}})");
  for (const Words& words : std::vector<Words>{
           {},
           {"dance"},
           {"solve", dir()},
           {"solve", dir() + "/none", "held"},
           {"solve", dir(), "L9"},
           {"solve", dir(), "cut"},
           {"solve", dir(), "text"},
           {"solve", dir(), "range"},
           {"solve", dir(), "inverted"},
           {"solve", dir(), "supports"},
           {"solve", dir(), "tip"},
           {"solve", dir(), "list"},
           {"solve", dir() + "/b", "held"},
           {"solve", dir() + "/c", "held"},
           {"solve", dir() + "/d", "held"},
           {"solve", dir(), "held", "--model", "rubber"},
           {"solve", dir(), "held", "--nu", "0.5"},
           {"solve", dir(), "held", "--nu", "-0.2"},
           {"solve", dir(), "held", "--nu", "nan"},
           {"solve", dir(), "held", "--young", "0"},
           {"solve", dir(), "held", "--young", "1e14"},
           {"modes", dir(), "held", "--count", "0"},
           {"modes", dir(), "held", "--count", "4"},
           {"modes", dir(), "held", "--nu", "0.7"},
           {"material", dir()},
           {"material", dir() + "/none"},
           {"material", dir() + "/e"},
           {"trajectory", dir(), "--run", "fall"},
           {"trajectory", dir(), "--run", "walk", "--dt", "0.01"},
           {"trajectory", dir() + "/c", "--run", "walk", "--dt", "0.01"},
           {"trajectory", dir() + "/f", "--run", "r", "--dt", "0.01"},
           {"trajectory", dir(), "--run", "fall", "--dt", "0"},
           {"trajectory", dir(), "--run", "fall", "--dt", "0.01", "--substeps", "0"},
           {"trajectory", dir(), "--run", "fall", "--dt", "0.01", "--integrator", "leapfrog"},
           {"trajectory", dir(), "--run", "fall", "--dt", "0.01", "--nu", "0.5"},
           {"bench", "tower"},
           {"bench", "beam", "--steps", "0"},
           {"bench", "beam", "--cells", "many"},
           {"bench", "beam", "--size", "2x0.4x0"},
           {"bench", "beam", "--young", "-1"},
           {"bench", "beam", "--nu", "0.5"},
       }) {
    const Ran ran = lab(words);
    EXPECT_EQ(ran.exit_code, 2) << testing::PrintToString(words);
    EXPECT_EQ(ran.line, "") << testing::PrintToString(words);
  }
}

TEST_F(LabProgram, ChoosesAmongPoissonRatiosOnlyWhenTold) {
  folder_.write("b/case.json", R"({"material": {"E": 1e6, "nu": [0.25, 0.4], "rho": 1}})");
  folder_.write("b/held.json", kHeld);
  EXPECT_EQ(lab({"solve", dir() + "/b", "held"}).exit_code, 2);
  EXPECT_EQ(lab({"solve", dir() + "/b", "held", "--nu", "0.25"}).json(), lab({"solve", dir(), "held"}).json());
}

TEST_F(LabProgram, ModesAreAscendingFrequencies) {
  const Ran ran = lab({"modes", dir(), "held", "--count", "3"});
  EXPECT_EQ(ran.exit_code, 0);
  const auto hz = ran.json()["lumped_Hz"].get<std::vector<double>>();
  ASSERT_EQ(hz.size(), 3u);
  // The top alone moves: k = V (mu, mu, 2 mu + lambda) about the three axes, m = rho V / 4.
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(hz[k], std::sqrt((k < 2 ? 4e5 : 1.2e6) / 250) / (2 * M_PI), 1e-6 * hz[k]) << k;
}

TEST_F(LabProgram, AFreeBodyFallsByTheDiscreteParabola) {
  constexpr double dt = 0.01, g = 9.81;
  const Ran ran = lab({"trajectory", dir(), "--run", "fall", "--dt", "0.05", "--substeps", "5"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_EQ(ran.more, "");
  const Json json = ran.json();
  for (const char* key : {"t", "tip", "tip_uz", "momentum", "angular_momentum", "kinetic", "elastic", "gravitational", "energy"}) EXPECT_EQ(json[key].size(), 11u) << key;
  ASSERT_TRUE(json["snapshots"].contains("0.25") && json["snapshots"].contains("0.5")) << json["snapshots"].dump();
  EXPECT_EQ(json["snapshots"]["0.5"].size(), 4u);
  EXPECT_EQ(json["snapshots"]["0.5"][3], json["tip"][10]);
  const double mass = 1000.0 / 6;
  for (int k = 0; k <= 10; ++k) {
    const int n = 5 * k;
    const double fallen = g * dt * dt * n * (n + 1) / 2;  // z_n = -g dt^2 n (n + 1) / 2, v_n = -g n dt
    EXPECT_NEAR(json["t"][k].get<double>(), 0.05 * k, 1e-12);
    EXPECT_NEAR(json["tip"][k][0].get<double>(), n * dt, 1e-11);
    EXPECT_NEAR(json["tip_uz"][k].get<double>(), -fallen, 1e-11);
    EXPECT_NEAR(json["momentum"][k][0].get<double>(), mass, 1e-9 * mass);
    EXPECT_NEAR(json["momentum"][k][2].get<double>(), -mass * g * n * dt, 1e-9 * mass);
    // About the origin; the centre of mass is at (1/4 + x, 1/4, 1/4 - fallen) and moves as a whole.
    const double vz = -g * n * dt, x = 0.25 + n * dt, z = 0.25 - fallen;
    EXPECT_NEAR(json["angular_momentum"][k][1].get<double>(), mass * (z - x * vz), 1e-8 * mass);
    EXPECT_NEAR(json["energy"][k].get<double>(), mass * (0.5 + 0.5 * vz * vz + g * z), 1e-8 * mass);
  }
}

// A parabola that BDF2's first step, one of backward Euler, has shifted by 3/4 g dt^2.
TEST_F(LabProgram, AFreeBodyFallsByTheParabolaIfItGoesByBdf2) {
  constexpr double dt = 0.01, g = 9.81;
  const Ran ran = lab({"trajectory", dir(), "--run", "fall", "--dt", "0.05", "--substeps", "5", "--integrator", "bdf2"});
  EXPECT_EQ(ran.exit_code, 0) << ran.more;
  const Json json = ran.json();
  for (int k = 0; k <= 10; ++k) {
    const double t = 0.05 * k, shift = 0.75 * (1 - std::pow(3.0, -5 * k)) * g * dt * dt;
    EXPECT_NEAR(json["tip_uz"][k].get<double>(), -g * t * t / 2 - shift, 1e-11);
    EXPECT_NEAR(json["momentum"][k][2].get<double>(), -1000.0 / 6 * g * t, 1e-7);
  }
}

TEST(LabProgramShared, AnswersForTheYardstickAsItsScoreReadsIt) {
  CRUMPLE_NEED_SHARED("yardstick/S05_torsion_square_bar");
  const std::string dir = test::shared_data("yardstick/S05_torsion_square_bar").string();
  const Ran ran = lab({"solve", dir, "L0_45deg"});
  EXPECT_EQ(ran.exit_code, 0);
  std::ifstream in(dir + "/L0_45deg.json");
  const Json level = Json::parse(in);
  EXPECT_EQ(ran.json()["displacements"].size(), level["nodes"].size());
  EXPECT_EQ(lab({"solve", test::shared_data("yardstick/S10_cook_membrane_nu").string(), "L0"}).exit_code, 2);
}

struct Bench {
  const char* scene;
  const char* steps;
};

void PrintTo(const Bench& bench, std::ostream* out) { *out << bench.scene; }

class LabBench : public testing::TestWithParam<Bench> {};

TEST_P(LabBench, PrintsItsKeysAndTheSameHashForOneAndTwoThreads) {
  const Bench bench = GetParam();
  const Ran one = lab({"bench", bench.scene, "--steps", bench.steps, "--json"});
  const Ran two = lab({"bench", bench.scene, "--steps", bench.steps, "--threads", "2"});
  ASSERT_EQ(one.exit_code, 0);
  ASSERT_EQ(two.exit_code, 0);
  EXPECT_EQ(one.more, "");
  const Json json = one.json();
  EXPECT_EQ(json["state_hash"].get<std::string>().size(), 16u);
  EXPECT_EQ(json["state_hash"], two.json()["state_hash"]);
  for (const char* key : {"mean", "median", "p99", "worst"}) EXPECT_GT(json["ms_per_step"][key].get<double>(), 0) << key;
  EXPECT_LE(json["ms_per_step"]["median"], json["ms_per_step"]["worst"]);
  double stages = 0;
  for (const auto& [name, ms] : json["stages"].items()) stages += ms.get<double>();
  EXPECT_GT(json["stages"].size(), 5u);
  EXPECT_LE(stages, json["ms_per_step"]["mean"].get<double>());
  EXPECT_GT(json["peak_rss_mb"].get<double>(), 1);
  const bool soft = std::string(bench.scene) != "barrels", beam = std::string(bench.scene) == "beam";
  EXPECT_EQ(json.contains("solver"), soft);
  EXPECT_EQ(json.contains("tip"), beam);
  EXPECT_EQ(json.contains("penetration_mm_worst"), !beam);
  for (const char* key : {"inverted", "fragments"}) EXPECT_EQ(json.contains(key), soft) << key;
  if (!soft) return;
  for (const char* key : {"iterations_mean", "residual_worst", "capped_steps"}) EXPECT_TRUE(json["solver"].contains(key)) << key;
  EXPECT_GT(json["solver"]["iterations_mean"].get<double>(), 0);
  EXPECT_LE(json["solver"]["residual_worst"].get<double>(), 1e-3);
  if (!beam) return;
  EXPECT_LT(json["tip"][1].get<double>(), 0);
}

TEST(LabBenchSleep, SaysWhoSleepsWhereSleepIsOn) {
  const Json off = lab({"bench", "barrels", "--steps", "4"}).json();
  EXPECT_FALSE(off.contains("sleep"));
  const Json on = lab({"bench", "barrels", "--steps", "4", "--sleep", "on"}).json();
  EXPECT_EQ(on["sleep"]["live_bodies"], 50);
  EXPECT_EQ(on["sleep"]["asleep_bodies"], 0);
  EXPECT_FALSE(on["sleep"].contains("all_asleep_at"));
  EXPECT_EQ(lab({"bench", "barrels", "--sleep", "perhaps"}).exit_code, 2);
}

TEST(LabBenchInvariants, HaveAnEntryAStepAndChangeNoBits) {
  const Ran plain = lab({"bench", "beam", "--steps", "4", "--integrator", "bdf2"});
  const Ran asked = lab({"bench", "beam", "--steps", "4", "--integrator", "bdf2", "--invariants"});
  ASSERT_EQ(asked.exit_code, 0) << asked.more;
  EXPECT_FALSE(plain.json().contains("invariants"));
  const Json json = asked.json();
  EXPECT_EQ(json["state_hash"], plain.json()["state_hash"]);
  EXPECT_NE(json["state_hash"], lab({"bench", "beam", "--steps", "4"}).json()["state_hash"]);
  for (const char* key : {"momentum", "angular_momentum", "kinetic", "elastic", "gravitational", "contact_work", "command_work",
                          "prescribed_work"}) {
    EXPECT_EQ(json["invariants"][key].size(), 4u) << key;
  }
  EXPECT_LT(json["invariants"]["momentum"][3][1].get<double>(), 0);
  EXPECT_GT(json["invariants"]["kinetic"][3].get<double>(), 0);
}

// Scenes of Jones et al. 2016: sizes within 10 % of the authors', who used N 1790, 8,238 tets, B 12, E 3 for barrels.
TEST(LabBenchDestruction, HasTheAuthorsSizesAndSaysWhereDeformationTakesItsTime) {
  const Ran one = lab({"bench", "dock", "--steps", "200"}), two = lab({"bench", "dock", "--steps", "200", "--threads", "2"});
  ASSERT_EQ(one.exit_code, 0);
  EXPECT_EQ(one.json()["state_hash"], two.json()["state_hash"]);
  const Json examples = one.json()["examples"];
  ASSERT_EQ(examples["assets"].size(), 1u);
  const Json barrel = examples["assets"][0];
  EXPECT_EQ(barrel["bodies"], 3);
  EXPECT_EQ(barrel["bones"], 12);
  EXPECT_EQ(barrel["examples"], 3);
  EXPECT_NEAR(barrel["vertices"].get<int>(), 1790, 179);
  EXPECT_NEAR(barrel["tets"].get<int>(), 8238, 824);
  EXPECT_GT(examples["plastic_impulses"].get<int>(), 0);
  double parts = 0;
  for (const char* part : {"locate", "projection", "propagation", "weights", "skinning", "shape"}) parts += examples["parts_ms"][part].get<double>();
  EXPECT_GT(parts, 0);
  EXPECT_LE(parts, examples["deform_ms"]["mean"].get<double>());
  EXPECT_GT(examples["rigid_ms"]["median"].get<double>(), 0);

  const Ran triangles = lab({"bench", "dock", "--steps", "200", "--collision", "triangles"});
  ASSERT_EQ(triangles.exit_code, 0);
  EXPECT_NE(triangles.json()["state_hash"], one.json()["state_hash"]);
}

TEST(LabBenchDestruction, EveryScene) {
  for (const char* scene : {"pachinko", "driver", "pileup", "cannonballs", "pegs", "space", "shipyard"}) {
    const Ran ran = lab({"bench", scene, "--steps", "2"});
    ASSERT_EQ(ran.exit_code, 0) << scene;
    EXPECT_FALSE(ran.json()["examples"]["assets"].empty()) << scene;
  }
}

INSTANTIATE_TEST_SUITE_P(LabProgram, LabBench,
                         testing::Values(Bench{"beam", "3"}, Bench{"pile", "12"}, Bench{"panel", "6"}, Bench{"barrels", "5"}),
                         [](const auto& info) { return std::string(info.param.scene); });

}  // namespace
}  // namespace crumple
