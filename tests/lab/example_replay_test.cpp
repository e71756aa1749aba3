// J01 of the yardstick, an independent computation of Jones et al. 2016, eqs. 1-15, as any user's program replays it: every
// intermediate value.
#include "common/text.h"
#include "server/lab/example_replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace crumple::lab {
namespace {

void flatten(const Json& j, std::vector<double>& out) {
  if (j.is_structured())
    for (const Json& item : j) flatten(item, out);
  else
    out.push_back(j);
}

// |got - reference| / max(1, max |reference|).
double error_of(const Json& reference, const Json& got) {
  std::vector<double> a, b;
  flatten(reference, a);
  flatten(got, b);
  if (a.size() != b.size()) return INFINITY;
  double scale = 1, worst = 0;
  for (double v : a) scale = std::max(scale, std::abs(v));
  for (std::size_t k = 0; k < a.size(); ++k) worst = std::max(worst, std::isfinite(b[k]) ? std::abs(a[k] - b[k]) / scale : INFINITY);
  return worst;
}

TEST(ExampleReplay, ReproducesTheOracleToRounding) {
  CRUMPLE_NEED_SHARED("yardstick/J01_example_plasticity/case.json");
  const auto path = test::shared_data("yardstick/J01_example_plasticity/case.json");
  const Json reference = (*read_json(path))["outputs"];
  const auto result = replay_example(path);
  ASSERT_TRUE(result) << result.error().text();
  const Json& got = (*result)["outputs"];
  std::map<std::string, double> worst;
  const auto compare = [&](const std::string& name, const Json& a, const Json& b) { worst[name] = std::max(worst[name], error_of(a, b)); };
  for (const char* key : {"sign_be", "mass", "vertex_mass"}) compare(key, reference[key], got[key]);
  ASSERT_EQ(got["frames"].size(), reference["frames"].size());
  for (std::size_t f = 0; f < got["frames"].size(); ++f) {
    const Json &a = reference["frames"][f], &b = got["frames"][f];
    for (const char* key : {"dE_accumulated", "dE_frobenius", "Cr", "E", "x", "com", "inertia", "com_tet", "inertia_tet", "principal_moments",
                            "n_inverted_tets"})
      compare(key, a[key], b[key]);
    ASSERT_EQ(a["J_after_sample"].size(), b["J_after_sample"].size());
    for (std::size_t k = 0; k < a["J_after_sample"].size(); ++k) compare("J_after", a["J_after_sample"][k]["J"], b["J_after_sample"][k]["J"]);
    ASSERT_EQ(a["impulses"].size(), b["impulses"].size());
    for (std::size_t k = 0; k < a["impulses"].size(); ++k)
      for (const char* key : {"dx", "J", "Jt_dx", "Jt_dx_norm", "de", "n_inside_kernel", "geo_dist"})
        compare(std::string("impulse.") + key, a["impulses"][k][key], b["impulses"][k][key]);
  }
  for (const auto& [key, error] : worst) {
    EXPECT_LT(error, 1e-11) << key;  // the reference's own second pass agrees to 6e-13
    RecordProperty(key, text(error));
  }
}

// A tet of one bone, and what is wrong with it.
TEST(ExampleReplay, BadCasesNameTheirField) {
  const Json good = Json::parse(R"({"inputs": {"u": [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], "tets": [[0,1,2,3]], "W": [[1],[1],[1],[1]],
    "examples": [{"name": "rest", "t": [[0,0,0]], "q_xyzw": [[0,0,0,1]]}], "dt": 0.004, "density": 100, "alpha": 1, "beta": 0, "gamma": 1,
    "lambda": 0.5, "mu": 1, "nu": 1, "Cr_star": 0.5, "frames": [{"impulses": [{"v": 3, "j": [0, 0, 5]}]}]}})");
  test::TemporaryFolder folder;
  const auto replay = [&](const char* pointer, const Json& value) {
    Json changed = good;
    if (pointer) changed[Json::json_pointer(pointer)] = value;
    folder.write("case.json", changed.dump());
    return replay_example(folder.path() / "case.json");
  };
  const auto sound = replay(nullptr, {});
  ASSERT_TRUE(sound) << sound.error().text();
  EXPECT_NEAR((*sound)["outputs"]["mass"].get<double>(), 100.0 / 6, 1e-12);
  for (const auto& [pointer, value, field] : std::vector<std::tuple<const char*, Json, std::string>>{
           {"/inputs/tets/0/1", 9, "inputs.tets[0][1]"},
           {"/inputs/u/2", Json{1, 2}, "inputs.u[2]"},
           {"/inputs/W/1/0", "x", "inputs.W[1][0]"},
           {"/inputs/lambda", 1, "inputs.lambda"},
           {"/inputs/frames/0/impulses/0/v", -1, "inputs.frames[0].impulses[0].v"},
           {"/inputs/examples/0/t", Json::array(), "inputs.examples[0].t"}}) {
    const auto result = replay(pointer, value);
    ASSERT_FALSE(result) << field;
    EXPECT_EQ(result.error().field, field) << result.error().text();
  }
}

}  // namespace
}  // namespace crumple::lab
