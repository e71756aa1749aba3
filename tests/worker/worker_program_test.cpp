// crumple-worker as a program.
#include "server/io/scene_file.h"
#include "server/sim/world.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>

namespace crumple::worker {
namespace {

const std::string kPane = std::string(CRUMPLE_SOURCE_DIR) + "/deploy/scenes/pane.json";

TEST(WorkerProgram, PrintsTheHashOfTheWorldThatItStepped) {
  const test::TemporaryFolder folder;
  const auto out = folder.path() / "out";
  test::ChildProcess worker({test::program("crumple-worker"), kPane, "--out", out.string(), "--steps", "40",
                             "--threads", "2", "--formats", "csv"});
  ASSERT_TRUE(worker.started());
  const std::string line = worker.read_line();
  EXPECT_EQ(worker.wait(), 0);

  const auto world = *sim::World::create(io::load_scene(kPane)->scene);
  for (int k = 0; k < 40; ++k) world->step();
  std::ostringstream hash;
  hash << "state hash " << std::hex << std::setw(16) << std::setfill('0') << world->state_hash();
  EXPECT_TRUE(line.starts_with("40 steps in ")) << line;
  EXPECT_TRUE(line.ends_with(hash.str())) << line << ", must end with " << hash.str();
  EXPECT_TRUE(std::filesystem::exists(out / "result.json"));
}

TEST(WorkerProgram, ExitsWithTwoOnBadInputAndWritesNothing) {
  const test::TemporaryFolder folder;
  const std::string bad = folder.write("bad.json", R"({"dt": "NaN"})").string(), out = (folder.path() / "out").string();
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{bad, "--out", out},
                                                    {"nowhere.json", "--out", out},
                                                    {kPane, "--out", out, "--steps", "0"},
                                                    {kPane, "--out", out, "--formats", "abc"},
                                                    {kPane}}) {
    std::vector<std::string> command{test::program("crumple-worker")};
    command.insert(command.end(), arguments.begin(), arguments.end());
    test::ChildProcess worker(command);
    ASSERT_TRUE(worker.started());
    EXPECT_EQ(worker.wait(), 2) << arguments[0];
  }
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace crumple::worker
