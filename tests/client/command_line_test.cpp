#include "client/cli/command_line.h"

#include <gtest/gtest.h>

#include <sstream>

#include "client/sdk/stream_file.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"

namespace crumple::cli {
namespace {

constexpr const char* kScene = R"({"name": "one box", "bodies": [
  {"name": "box", "pose": {"position": {"y": 2}}, "rigid": {"shapes": [{"box": {}}]}}]})";

class CommandLine : public testing::Test {
 protected:
  int run(std::vector<std::string> words) {
    words.insert(words.begin(), {"crumple", "--server", server_->address()});
    return run_plain(words);
  }
  int run_plain(const std::vector<std::string>& words) {
    std::vector<const char*> argv;
    for (const std::string& word : words) argv.push_back(word.c_str());
    std::ostringstream out, err;
    const int code = cli::run(static_cast<int>(argv.size()), argv.data(), out, err, stop_);
    out_ = out.str();
    err_ = err.str();
    return code;
  }

  std::unique_ptr<grpc_server::SimulationServer> server_ = test::start_server();
  test::TemporaryFolder folder_;
  std::string scene_ = folder_.write("box.json", kScene).string();
  std::atomic<bool> stop_ = false;
  std::string out_, err_;
};

TEST_F(CommandLine, CreatesStepsAndDeletes) {
  ASSERT_EQ(run({"create", scene_, "--name", "mine"}), kOk) << err_;
  EXPECT_EQ(out_, "1\n");
  ASSERT_EQ(run({"list"}), kOk);
  EXPECT_NE(out_.find("world 1  mine  paused  step 0"), std::string::npos) << out_;
  ASSERT_EQ(run({"step", "1", "12", "--hash"}), kOk) << err_;
  EXPECT_TRUE(out_.starts_with("step 12  time 0.1 s")) << out_;
  const std::string hash = out_.substr(out_.find("hash"));
  ASSERT_EQ(run({"hash", "1"}), kOk);
  EXPECT_EQ(out_.substr(out_.find("hash")), hash);
  ASSERT_EQ(run({"delete", "1"}), kOk);
  EXPECT_EQ(run({"delete", "1"}), kRefused);
  EXPECT_NE(err_.find("world is 1, there is no such world"), std::string::npos) << err_;
}

TEST_F(CommandLine, PushesBodies) {
  ASSERT_EQ(run({"create", scene_}), kOk) << err_;
  ASSERT_EQ(run({"push", "1", "box", "--impulse", "-1000,0,0", "--at", "0,2,0"}), kOk) << err_;
  EXPECT_EQ(out_, "acts in step 1\n");
  ASSERT_EQ(run({"step", "1", "1"}), kOk);
  ASSERT_EQ(run({"info", "1"}), kOk);
  EXPECT_NE(out_.find("velocity -1,"), std::string::npos) << out_;  // 1000 N s on 1000 kg
  EXPECT_EQ(run({"push", "1", "box", "--impulse", "nan,0,0", "--at", "0,2,0"}), kUsage);
  EXPECT_EQ(run({"push", "1", "box", "--impulse", "1,2", "--at", "0,2,0"}), kUsage);
  EXPECT_EQ(run({"push", "1", "box", "--at", "0,2,0"}), kUsage);
  EXPECT_EQ(run({"push", "1", "nobody", "--impulse", "1,0,0", "--at", "0,2,0"}), kRefused);
  EXPECT_NE(err_.find("command.apply_impulse.body"), std::string::npos) << err_;
}

TEST_F(CommandLine, PlaysAndPauses) {
  ASSERT_EQ(run({"create", scene_, "--play"}), kOk) << err_;
  EXPECT_EQ(run({"step", "1", "1"}), kRefused);
  EXPECT_EQ(run({"watch", "1", "--frames", "3"}), kOk) << err_;
  EXPECT_TRUE(out_.starts_with("step ")) << out_;
  EXPECT_EQ(std::count(out_.begin(), out_.end(), '\n'), 3);
  ASSERT_EQ(run({"pause", "1"}), kOk);
  EXPECT_TRUE(out_.starts_with("step ")) << out_;
  EXPECT_EQ(run({"play", "1", "--speed", "-1"}), kRefused);
}

TEST_F(CommandLine, RunsScripts) {
  ASSERT_EQ(run({"create", scene_}), kOk) << err_;
  const auto script = folder_.write("script.json", R"({"commands": [{"time": 0.05, "command": {"apply_impulse":
      {"body": "box", "impulse": {"x": 1000}, "point": {"y": 2}}}}]})");
  ASSERT_EQ(run({"script", "1", script.string()}), kOk) << err_;
  ASSERT_EQ(run({"step", "1", "12"}), kOk);
  ASSERT_EQ(run({"info", "1"}), kOk);
  EXPECT_NE(out_.find("velocity 1,"), std::string::npos) << out_;
  EXPECT_EQ(run({"script", "1", scene_}), kUsage);
}

TEST_F(CommandLine, RecordsTheStream) {
  ASSERT_EQ(run({"create", scene_, "--play"}), kOk) << err_;
  const std::string file = (folder_.path() / "stream").string();
  ASSERT_EQ(run({"record", "1", file, "--frames", "4"}), kOk) << err_;
  EXPECT_TRUE(out_.starts_with("4 frames, ")) << out_;
  auto reader = client::StreamFileReader::open(file);
  ASSERT_TRUE(reader);
  client::UpdateDecoder decoder;
  const auto topology = decoder.decode(**reader->next());
  ASSERT_TRUE(topology && *topology && std::holds_alternative<Topology>(**topology));
  EXPECT_EQ(std::get<Topology>(**topology).bodies.at(0).name, "box");
  int frames = 0;
  for (auto update = reader->next(); update && *update; update = reader->next()) {
    const auto decoded = decoder.decode(**update);
    ASSERT_TRUE(decoded && *decoded);
    frames += std::holds_alternative<Frame>(**decoded) ? 1 : 0;
  }
  EXPECT_EQ(frames, 4);
}

TEST_F(CommandLine, StopEndsAWatch) {
  ASSERT_EQ(run({"create", scene_}), kOk);
  stop_ = true;
  EXPECT_EQ(run({"watch", "1"}), kOk);
}

TEST_F(CommandLine, ExitCodesTellWhoIsToBlame) {
  EXPECT_EQ(run({}), kUsage);
  EXPECT_EQ(run({"step"}), kUsage);
  EXPECT_EQ(run({"create", folder_.write("bad.json", "{\"dt\": }").string()}), kUsage);
  EXPECT_EQ(run({"create", folder_.write("nan.json", R"({"dt": "NaN"})").string()}), kRefused);
  EXPECT_NE(err_.find("scene.dt is nan"), std::string::npos) << err_;
  EXPECT_EQ(run({"create", "no-such-scene"}), kRefused);
  EXPECT_EQ(run({"--help"}), kOk);
  EXPECT_NE(out_.find("Exit codes"), std::string::npos);
  server_->stop();
  EXPECT_EQ(run({"--timeout", "0.2", "list"}), kUnreachable);
}

}  // namespace
}  // namespace crumple::cli
