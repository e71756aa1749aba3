// crumple-server as a program: its line, its signals, its exit codes, its scene folder.
#include <gtest/gtest.h>

#include <algorithm>

#include "client/sdk/simulation_client.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace crumple {
namespace {

constexpr const char* kScene = R"({"name": "one box", "bodies": [
  {"name": "box", "pose": {"position": {"y": 2}}, "rigid": {"shapes": [{"box": {}}]}}]})";

std::string address_of(test::ChildProcess& server) {
  const std::string line = server.read_line();
  EXPECT_TRUE(line.starts_with("crumple-server listens on 127.0.0.1:")) << line;
  return line.substr(line.rfind(' ') + 1);
}

TEST(ServerProgram, TellsItsAddressPlaysItsWorldAndStopsOnSigterm) {
  const test::TemporaryFolder folder;
  folder.write("box.json", kScene);
  test::ChildProcess server({test::program("crumple-server"), "--listen", "127.0.0.1:0", "--quiet", "--scenes",
                             folder.path().string(), "--world", "box"});
  const auto client = client::connect(address_of(server));
  ASSERT_TRUE(client) << client.error().text();
  const auto worlds = (*client)->list_worlds();
  ASSERT_TRUE(worlds);
  ASSERT_EQ(worlds->size(), 1u);
  EXPECT_EQ(worlds->at(0).name, "one box");
  EXPECT_EQ(worlds->at(0).state, WorldState::playing);
  EXPECT_EQ(server.end(SIGTERM), 0);
}

TEST(ServerProgram, TakesScenesByNameAndNoneFromOutside) {
  const test::TemporaryFolder folder;
  folder.write("scenes/box.json", kScene);
  folder.write("secret.json", kScene);
  std::filesystem::create_symlink(folder.path() / "secret.json", folder.path() / "scenes" / "link.json");
  test::ChildProcess server({test::program("crumple-server"), "--listen", "127.0.0.1:0", "--quiet", "--scenes",
                             (folder.path() / "scenes").string()});
  const auto client = client::connect(address_of(server));
  ASSERT_TRUE(client) << client.error().text();
  EXPECT_TRUE((*client)->create_world_from_file("box"));
  EXPECT_TRUE((*client)->create_world_from_file("box.json"));
  EXPECT_EQ((*client)->create_world_from_file("none").error().code, ErrorCode::not_found);
  EXPECT_EQ((*client)->create_world_from_file("../secret").error().code, ErrorCode::invalid_argument);
  EXPECT_EQ((*client)->create_world_from_file("/etc/passwd").error().field, "scene_file");
  EXPECT_EQ((*client)->create_world_from_file("").error().code, ErrorCode::invalid_argument);
  EXPECT_EQ((*client)->create_world_from_file("link").error().code, ErrorCode::not_found);
  const auto scenes = (*client)->list_scenes();
  ASSERT_TRUE(scenes);
  EXPECT_NE(std::ranges::find(*scenes, "box"), scenes->end());
  EXPECT_EQ(server.end(SIGINT), 0);
}

TEST(ServerProgram, ExitsWithOneIfItCannotListen) {
  test::ChildProcess first({test::program("crumple-server"), "--listen", "127.0.0.1:0", "--quiet"});
  const std::string address = address_of(first);
  EXPECT_EQ(test::ChildProcess({test::program("crumple-server"), "--listen", address}).wait(), 1);
}

TEST(ServerProgram, ExitsWithTwoOnBadOptionsAndBadScenes) {
  const test::TemporaryFolder folder;
  folder.write("bad.json", R"({"dt": -1})");
  const std::string server = test::program("crumple-server");
  EXPECT_EQ(test::ChildProcess({server, "--threads", "0"}).wait(), 2);
  EXPECT_EQ(test::ChildProcess({server, "--world", "bad"}).wait(), 2);
  EXPECT_EQ(test::ChildProcess({server, "--listen", "127.0.0.1:0", "--scenes", folder.path().string(), "--world", "bad"}).wait(), 2);
  EXPECT_EQ(test::ChildProcess({server, "--listen", "127.0.0.1:99999"}).wait(), 2);
  EXPECT_EQ(test::ChildProcess({server, "--help"}).wait(), 0);
}

}  // namespace
}  // namespace crumple
