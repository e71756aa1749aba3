// Points, bones and cages, from a file to an asset's weights.
#include "common/text.h"
#include "server/io/asset_file.h"
#include "server/rig/rig_files.h"
#include "tests/rig/rig_program.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

namespace crumple::rig {
namespace {

using sim::example_based::ExampleSet;
using ::testing::HasSubstr;

// A bar along x of 10 m, 0.2 m thick.
std::string bar() {
  std::string out;
  for (int k = 0; k < 8; ++k) out += text("v ", k & 1 ? 10 : 0, " ", k & 2 ? 0.1 : -0.1, " ", k & 4 ? 0.1 : -0.1, "\n");
  return out + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 2 4 8 6\nf 1 5 7 3\n";
}

class RigHandlesOfABar : public testing::Test {
 protected:
  ExampleSet made(const std::string& handles, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{
        folder_.write("bar.obj", bar()).string(), "--out", asset_, "--cell-size", "0.1", "--tets", "20000", "--handles",
        folder_.write("h.json", handles).string()};
    words.insert(words.end(), more.begin(), more.end());
    const auto [code, result] = run(words);
    EXPECT_EQ(code, 0);
    summary_ = result;
    auto read = io::read_asset(asset_);
    EXPECT_TRUE(read) << read.error().text();
    return read ? std::get<ExampleSet>(std::move(read->content)) : ExampleSet{};
  }
  // How far column b is from a function of x, at its worst.
  static double worst(const ExampleSet& set, int b, const std::function<double(double)>& wanted) {
    double out = 0;
    for (int i = 0; i < set.vertex_count(); ++i)
      out = std::max(out, std::abs(set.W(i, b) - wanted(std::clamp(set.mesh.X[i].x(), 0.0, 10.0))));
    return out;
  }

  test::TemporaryFolder folder_;
  std::string asset_ = (folder_.path() / "bar.crumple-asset").string();
  json summary_;
};

double cubic(double s) { return s <= 0 ? 0 : s >= 1 ? 1 : 3 * s * s - 2 * s * s * s; }

// The optimum in one dimension: w'' squared is least, w is 0 along the first bone and 1 along the second, and so w' is
// 0 at the ends of both: 3 s^2 - 2 s^3 from one to the other. 0.04: a bone ends at a node, up to 0.1 m from its own
// end, where the cubic rises by 1.5 over 4 m.
TEST_F(RigHandlesOfABar, BetweenTwoBonesWeightsAreACubic) {
  const ExampleSet set = made(R"({"bones": [
      {"name": "left", "from": {"x": 3}, "to": {}}, {"name": "right", "from": {"x": 7}, "to": {"x": 10}}]})");
  ASSERT_EQ(set.bone_count(), 2);
  EXPECT_LT(worst(set, 1, [](double x) { return cubic((x - 3) / 4); }), 0.04);
  EXPECT_GT(worst(set, 1, [](double x) { return cubic(x / 10); }), 0.15) << "which two points at the ends would give";
  EXPECT_EQ(set.handles[0].name, "left");
  EXPECT_EQ(set.handles[0].position, Vec3(3, 0, 0)) << "it turns about the end that is named first";
  EXPECT_EQ(summary_["handles"]["bones"], 2);
}

// Along a cage's edges weights are linear, whatever else would be smoother.
TEST_F(RigHandlesOfABar, AlongACageWeightsAreLinear) {
  const ExampleSet set =
      made(R"({"cages": [{"name": "spine", "points": [{}, {"x": 3}, {"x": 10}], "edges": [0, 1, 1, 2]}]})");
  ASSERT_EQ(set.bone_count(), 3);
  EXPECT_LT(worst(set, 0, [](double x) { return std::max(0.0, 1 - x / 3); }), 0.03);
  EXPECT_LT(worst(set, 1, [](double x) { return x < 3 ? x / 3 : (10 - x) / 7; }), 0.03);
  EXPECT_LT(worst(set, 2, [](double x) { return std::max(0.0, (x - 3) / 7); }), 0.03);
  EXPECT_EQ(set.handles[2].name, "spine 3");
}

// A closed cage around the bar, as its own file: the weights of all four corners of an end are linear along the bar.
TEST_F(RigHandlesOfABar, ACageMayBeAMeshAroundTheBody) {
  std::string cage = bar();
  folder_.write("cage.obj", cage);
  const ExampleSet set = made(R"({"cages": [{"name": "box", "file": "cage.obj"}]})");
  ASSERT_EQ(set.bone_count(), 8);
  ExampleSet ends = set;
  ends.W.setZero(set.vertex_count(), 1);
  for (int b = 0; b < 8; ++b)
    if (set.handles[b].position.x() > 5) ends.W += set.W.col(b);
  EXPECT_LT(worst(ends, 0, [](double x) { return x / 10; }), 0.03);
  EXPECT_EQ(summary_["handles"]["cage_triangles"], 12);
}

TEST_F(RigHandlesOfABar, AllKindsStandTogetherAndAutomaticOnesKeepAway) {
  const ExampleSet set = made(R"({"handles": [{"name": "tip", "position": {"x": 10}}],
                                  "bones": [{"name": "grip", "from": {}, "to": {"x": 4}}],
                                  "cages": [{"name": "c", "points": [{"x": 6}, {"x": 7}], "edges": [0, 1]}]})",
                              {"--auto", "3"});
  ASSERT_EQ(set.bone_count(), 7);
  EXPECT_NEAR(set.W.rowwise().sum().minCoeff(), 1, 1e-9);
  EXPECT_GE(set.W.minCoeff(), 0);
  for (int b = 4; b < 7; ++b) EXPECT_GT(set.handles[b].position.x(), 4.4) << "not along the bone";
  EXPECT_EQ(summary_["handles"]["given"], 4);
  EXPECT_EQ(summary_["handles"]["automatic"], 3);
}

TEST_F(RigHandlesOfABar, WhatIsWrongIsNamed) {
  const auto says = [&](const std::string& handles) {
    const auto read = read_handles(folder_.write("h.json", handles));
    return read ? "" : read.error().text();
  };
  EXPECT_THAT(says("{\n\"bones\": [{\"name\": \"a\", \"from\": {\"x\": 1}, \"to\": {\"x\": 1}}]}"),
              HasSubstr("bones[0].to is where `from` is, must be elsewhere (h.json, line 2)"));
  EXPECT_THAT(says(R"({"bones": [{"from": {"x": 1}}]})"), HasSubstr("bones[0].name has 0 bytes, must have 1 to 256"));
  EXPECT_THAT(says(R"({"bones": [{"name": "a", "from": {"x": 1e9}}]})"), HasSubstr("bones[0].from must be finite"));
  EXPECT_THAT(says(R"({"handles": [{"name": "a"}], "bones": [{"name": "a", "to": {"x": 1}}]})"),
              HasSubstr("bones[0].name is \"a\", which another handle has"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "points": [{}, {"x": 1}]}]})"),
              HasSubstr("cages[0] has no edges and no triangles"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "points": [{}, {"x": 1}], "edges": [0]}]})"),
              HasSubstr("cages[0].edges holds 1 ids, must hold 2 an edge"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "points": [{}, {"x": 1}], "triangles": [0, 1, 2]}]})"),
              HasSubstr("cages[0].triangles[0] names point 2, must be in [0, 2)"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "points": [{}, {"x": 1}], "edges": [1, 1]}]})"),
              HasSubstr("cages[0].edges[0] names point 1 twice"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "points": [{}, {"x": 1}, {"x": 2}], "edges": [0, 1]}]})"),
              HasSubstr("cages[0].points[2] is in no edge and no triangle, must be in one"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "file": "no.obj"}]})"), HasSubstr("cages[0].file cannot be read"));
  EXPECT_THAT(says(R"({"cages": [{"name": "a", "file": "no.obj", "edges": [0, 1]}]})"),
              HasSubstr("cages[0].file is given beside points"));
  EXPECT_THAT(says(R"({"lattices": []})"), HasSubstr("lattices")) << "an unknown kind";

  const std::string mesh = folder_.write("bar.obj", bar()).string();
  for (const auto& [handles, weights] :
       {std::pair(R"({"bones": [{"name": "a", "from": {"y": 30}, "to": {"y": 50}}]})", "biharmonic"),
        std::pair(R"({"bones": [{"name": "a", "from": {}, "to": {"x": 5}}]})", "gaussian")})
    EXPECT_EQ(run({mesh, "--out", asset_, "--handles", folder_.write("h.json", handles).string(), "--weights", weights})
                  .first,
              2);
}

}  // namespace
}  // namespace crumple::rig
