// From an asset to parts that come apart, as a program and in a world.
#include "server/io/asset_file.h"
#include "server/io/scene_file.h"
#include "server/sim/world.h"
#include "tests/rig/rig_program.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

namespace crumple::rig {
namespace {

using sim::example_based::ExampleSet;

class RigBreak : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }

  // The block's asset: 2 x 1 x 1 m, eight handles, a crushed pose for each side.
  std::string asset() {
    EXPECT_EQ(run({folder_.write("block.obj", kBlock).string(), "--out", at("block.crumple-asset"), "--tets", "600",
                   "--auto", "8"})
                  .first,
              0);
    return at("block.crumple-asset");
  }
  sim::SceneDescription scene(const std::string& name) {
    auto loaded = io::load_scene(at(name));
    EXPECT_TRUE(loaded) << loaded.error().text();
    return loaded ? std::move(loaded->scene) : sim::SceneDescription{};
  }
  static ExampleSet set_of(const json& part) {
    auto read = io::read_asset(part["asset"].get<std::string>());
    EXPECT_TRUE(read) << read.error().text();
    return read ? std::get<ExampleSet>(std::move(read->content)) : ExampleSet{};
  }

  test::TemporaryFolder folder_;
};

// A face of 1 m^2 and the stress asked for: the force, and the moment of a square beam's outer fibre, sigma s^3 / 6.
// 3 %: the tets enclose the surface, so that they are a little thicker.
TEST_F(RigBreak, AJointBearsItsFacesAreaTimesTheStrength) {
  const auto [code, result] = run({"break", asset(), "--by", "planes", "--plane", "3", "0", "0", "0", "--strength",
                                   "5e4", "--out", at("two.json")});
  ASSERT_EQ(code, 0);
  ASSERT_EQ(result["parts"].size(), 2u);
  const auto two = scene("two.json");
  ASSERT_EQ(two.joints.size(), 1u);
  EXPECT_NEAR(two.joints[0].strength, 5e4, 0.03 * 5e4);
  EXPECT_NEAR(two.joints[0].bending, 5e4 / 6, 0.05 * 5e4 / 6);
  EXPECT_LT((two.joints[0].point - Vec3(0, 0.5, 0)).norm(), 0.03);
  EXPECT_NEAR(result["parts"][0]["volume"].get<double>(), 1, 0.05);
}

TEST_F(RigBreak, EveryWayOfScoringMakesPartsThatFillTheWhole) {
  const std::string whole = asset();
  double volume = 0;
  const ExampleSet set = set_of({{"asset", whole}});
  for (int t = 0; t < set.mesh.tet_count(); ++t) volume += sim::signed_volume(set.mesh, t);
  for (const char* by : {"planes", "voronoi", "bricks", "wood", "stone", "glass"}) {
    const auto [code, result] =
        run({"break", whole, "--by", by, "--pieces", "5", "--out", at("b.json"), "--picture", at("b.png")});
    ASSERT_EQ(code, 0) << by;
    EXPECT_GE(result["parts"].size(), 4u) << by;
    EXPECT_GE(result["joints"].get<std::size_t>(), result["parts"].size() - 1) << by;
    double sum = 0;
    for (const json& part : result["parts"]) sum += part["volume"].get<double>();
    EXPECT_NEAR(sum, volume, 1e-6 * volume) << by;
    EXPECT_THAT(content_of(at("b.png")), testing::StartsWith("\x89PNG"));
    EXPECT_TRUE(sim::World::create(scene("b.json"))) << by;
  }
}

// Struck by the ball, it breaks and its parts dent; left alone, it stands.
TEST_F(RigBreak, ItStandsUntilItIsStruckAndThenBreaksAndDents) {
  const std::string whole = asset();
  for (const bool struck : {false, true}) {
    std::vector<std::string> words{"break", whole, "--by", "voronoi", "--pieces", "7", "--out", at("s.json")};
    if (!struck) words.push_back("--unstruck");
    const auto [code, result] = run(words);
    ASSERT_EQ(code, 0);
    const std::size_t parts = result["parts"].size();
    sim::SceneDescription description = scene("s.json");
    if (!struck)  // awake, it has to carry itself
      for (sim::BodyDescription& body : description.bodies) body.asleep = false;
    const auto world = sim::World::create(description);
    ASSERT_TRUE(world) << world.error().text();
    int broken = 0;
    for (int k = 0; k < 360; ++k) broken += (*world)->step().broken_joints;
    double dented = 0, moved = 0;
    for (std::size_t p = 0; p < parts; ++p) {
      const BodyId body = (*world)->find("part " + std::to_string(p + 1));
      dented = std::max(dented, 1 - (*world)->example_weights(body).col(0).minCoeff());
      moved = std::max(moved, ((*world)->pose(body).p_WB - Vec3(0, 0, 0)).norm());
    }
    if (struck) {
      EXPECT_GT(broken, 2);
      EXPECT_GT(dented, 0.05);
      EXPECT_GT(moved, 0.2);
    } else {
      EXPECT_EQ(broken, 0);
      EXPECT_LT(dented, 1e-3);
      EXPECT_LT(moved, 0.05);
    }
  }
}

// What the artist made of the whole is there in each part: its handles, by which it is posed on, and its examples.
TEST_F(RigBreak, PartsKeepHandlesAndExamples) {
  const std::string whole = asset();
  const ExampleSet before = set_of({{"asset", whole}});
  const auto [code, result] = run({"break", whole, "--by", "planes", "--pieces", "3", "--out", at("b.json")});
  ASSERT_EQ(code, 0);
  for (const json& part : result["parts"]) {
    const ExampleSet set = set_of(part);
    ASSERT_EQ(static_cast<int>(set.handles.size()), set.bone_count());
    EXPECT_EQ(set.example_count(), before.example_count());
    for (int b = 0; b < set.bone_count(); ++b) {
      const auto of_whole = std::ranges::find(before.handles, set.handles[b].name, &sim::example_based::Handle::name);
      ASSERT_NE(of_whole, before.handles.end());
      const auto column = of_whole - before.handles.begin();
      EXPECT_EQ(set.examples[1].bones[b].t, before.examples[1].bones[column].t);
      EXPECT_EQ(set.handles[b].position, of_whole->position);
    }
  }
  const std::string first = result["parts"][0]["asset"];
  const std::string handle = set_of(result["parts"][0]).handles[0].name;
  EXPECT_EQ(run({"pose", first, "--name", "mine", "--handle", handle, "0", "2", "0"}).first, 0);
  EXPECT_EQ(run({"break", first, "--pieces", "2", "--out", at("again.json")}).first, 0) << "parts of a part";
}

TEST_F(RigBreak, BadInputIsNamedAndWritesNothing) {
  const std::string whole = asset();
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"break", whole},
           {"break", whole, "--out", at("x.crumple-asset")},
           {"break", "nowhere.crumple-asset", "--out", at("x.json")},
           {"break", whole, "--out", at("x.json"), "--by", "laser"},
           {"break", whole, "--out", at("x.json"), "--pieces", "1"},
           {"break", whole, "--out", at("x.json"), "--by", "planes", "--plane", "0", "0", "0", "1"},
           {"break", whole, "--out", at("x.json"), "--by", "bricks", "--block", "1", "-1", "1"},
           {"break", whole, "--out", at("x.json"), "--by", "stone", "--size", "0.001"},
           {"break", whole, "--out", at("x.json"), "--by", "wood", "--aspect", "0.5"},
           {"break", whole, "--out", at("x.json"), "--strength", "-1"},
           {"break", whole, "--out", at("x.json"), "--density", "0"},
           {"break", whole, "--out", at("x.json"), "--least-part", "1"},
           {"break", whole, "--out", at("x.json"), "--picture", at("x.json")}})
    EXPECT_EQ(run(words).first, 2) << testing::PrintToString(words);
  EXPECT_FALSE(std::filesystem::exists(at("x.json")));
  EXPECT_FALSE(std::filesystem::exists(at("x_parts")));
}

}  // namespace
}  // namespace crumple::rig
