#include "server/lab/step_comparison.h"

#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace crumple::lab {
namespace {

using ::testing::HasSubstr;

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::filesystem::path drop(const test::TemporaryFolder& folder) {
  return folder.write("drop.json", R"({"dt": 0.004, "bodies": [
    {"name": "ground", "rigid": {"kind": "FIXED", "shapes": [{"plane": {}}]}},
    {"name": "barrel", "pose": {"position": {"y": 1.5}}, "example": {"asset": {"barrel": {}},
     "parameters": {"alpha": 20, "beta": 5, "gamma": 0.6}, "mass": 200}}]})");
}

// One drop, three options: a tenth of a size is a tenth of a step with eq. 8; eq. 10 is smaller by |J^T dx| / |dx|, a
// move of decimetres between examples.
TEST(StepComparison, OptionsDentTheSameDropDifferently) {
  const test::TemporaryFolder folder;
  StepComparison comparison{.scene = drop(folder), .times = {0.3, 0.8}, .picture = folder.path() / "steps.png"};
  const auto result = compare_steps(comparison);
  ASSERT_TRUE(result) << result.error().text();
  const auto mean = [&](const char* step) { return (*result)[step]["barrel"]["weight_mean"].get<double>(); };
  EXPECT_GT(mean("equation8"), 0.01);
  EXPECT_LT(mean("equation10"), 0.5 * mean("equation8"));
  EXPECT_GT(std::abs(mean("equation9") - mean("equation8")), 0.01);
  EXPECT_THAT(content_of(comparison.picture), testing::StartsWith("\x89PNG"));

  // Alpha is linear in eq. 10: what one option is given is not what the others are.
  comparison.alphas = {20, 20, 40};
  const auto stronger = compare_steps(comparison);
  ASSERT_TRUE(stronger) << stronger.error().text();
  EXPECT_EQ((*stronger)["equation8"], (*result)["equation8"]);
  EXPECT_GT((*stronger)["equation10"]["barrel"]["weight_mean"].get<double>(), 1.2 * mean("equation10"));
}

TEST(StepComparison, NamesWhatIsWrong) {
  const test::TemporaryFolder folder;
  const auto says = [&](auto change) {
    StepComparison comparison{.scene = drop(folder), .picture = folder.path() / "steps.png"};
    change(comparison);
    const auto result = compare_steps(comparison);
    return result ? std::string("nothing") : result.error().text();
  };
  EXPECT_THAT(says([](auto& c) { c.times = {2, 1}; }), HasSubstr("times must be one or more, ascending"));
  EXPECT_THAT(says([](auto& c) { c.times = {}; }), HasSubstr("times"));
  EXPECT_THAT(says([](auto& c) { c.alphas = {1, 2}; }), HasSubstr("alphas are 2, must be 3"));
  EXPECT_THAT(says([](auto& c) { c.alphas = {1, -2, 3}; }), HasSubstr("alpha"));
  EXPECT_THAT(says([](auto& c) { c.picture = "a.svg"; }), HasSubstr("must end in .png"));
  EXPECT_THAT(says([](auto& c) { c.scene = "nowhere.json"; }), HasSubstr("nowhere.json"));
  EXPECT_THAT(says([&](auto& c) { c.scene = folder.write("bare.json", R"({"bodies": []})"); }), HasSubstr("bodies"));
}

}  // namespace
}  // namespace crumple::lab
