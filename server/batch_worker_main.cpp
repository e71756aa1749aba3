// crumple-worker: one batch job. A scene in, N steps, results out.
// Exit: 0 done; 2 bad input; 1 anything else.
#include "server/io/scene_file.h"
#include "server/worker/job.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>

using namespace crumple;

namespace {

// "[#####.....] 120/300  0:07 left", redrawn in place on a terminal, a line every tenth part elsewhere.
class ProgressBar {
 public:
  explicit ProgressBar(int total) : total_(total), terminal_(isatty(STDERR_FILENO)), start_(std::chrono::steady_clock::now()) {}
  void show(int done) {
    const int tenth = 10 * done / total_;
    if (!terminal_ && tenth == shown_) return;
    if (terminal_ && done != total_ && std::chrono::steady_clock::now() - drawn_ < std::chrono::milliseconds(100)) return;
    shown_ = tenth;
    drawn_ = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(drawn_ - start_).count();
    const int left = static_cast<int>(seconds / done * (total_ - done) + 0.5);
    const int filled = 30 * done / total_;
    std::fprintf(stderr, "%s[%s%s] %d/%d  %d:%02d left%s", terminal_ ? "\r" : "", std::string(filled, '#').c_str(),
                 std::string(30 - filled, '.').c_str(), done, total_, left / 60, left % 60, terminal_ && done != total_ ? "" : "\n");
  }

 private:
  int total_;
  bool terminal_;
  int shown_ = -1;
  std::chrono::steady_clock::time_point start_, drawn_;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Steps a scene file and writes its results: recording, .vtu and .pvd of finite-element bodies, .ply of the "
               "rest, .csv of energies, events and timings."};
  std::string scene, out;
  int steps = 300, threads = 1, every = 0;
  std::vector<std::string> formats;
  app.add_option("scene", scene, "scene file (JSON of crumple.v1.Scene)")->required();
  app.add_option("--out", out, "folder of the results; an older run's is replaced")->required();
  app.add_option("--steps", steps)->check(CLI::Range(1, 100'000'000))->capture_default_str();
  app.add_option("--threads", threads, "the results do not depend on it")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--every", every, "steps between two records, instead of the scene's")->check(CLI::Range(1, 1'000'000));
  app.add_option("--formats", formats, "instead of the scene's")->delimiter(',')->check(CLI::IsMember({"frames", "vtu", "ply", "csv"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }

  const auto fail = [](const Error& error) {
    std::cerr << "crumple-worker: " << error.text() << "\n";
    return error.code == ErrorCode::invalid_argument || error.code == ErrorCode::not_found ? 2 : 1;
  };
  auto loaded = io::load_scene(scene);
  if (!loaded) return fail(loaded.error());
  worker::Job job{.scene = std::move(loaded->scene), .recording = loaded->recording, .steps = steps, .threads = threads, .out = out};
  if (every > 0) job.recording.every = every;
  if (!formats.empty()) {
    const auto wants = [&](const char* name) { return std::find(formats.begin(), formats.end(), name) != formats.end(); };
    job.recording.frames = wants("frames");
    job.recording.vtu = wants("vtu");
    job.recording.ply = wants("ply");
    job.recording.csv = wants("csv");
  }
  ProgressBar progress(steps);
  const auto report = worker::run_job(job, [&](int k) { progress.show(k); });
  if (!report) return fail(report.error());
  std::printf("%d steps in %.0f ms (%.2f of real time), state hash %016llx\n", steps, report->wall_ms,
              steps * job.scene.dt * 1000 / report->wall_ms, static_cast<unsigned long long>(report->state_hash));
  return 0;
}
