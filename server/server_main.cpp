// crumple-server: SimulationService over gRPC. See --help.
#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <filesystem>
#include <future>
#include <iostream>

#include "server/folder_scenes.h"
#include "server/grpc/simulation_server.h"

namespace {

using namespace crumple;

struct Options {
  std::string listen = "127.0.0.1:50061";
  std::string scenes;
  std::vector<std::string> worlds;
  int threads = 1;
  int max_worlds = 16;
  bool quiet = false;
};

constexpr const char* kAbout =
    "Steps worlds in which things bend, dent and break, and streams them to clients over gRPC.\n"
    "Prints one line with the address it listens on, logs on standard error, and runs until SIGINT or SIGTERM.\n"
    "There is no authentication: listen on loopback, or behind something that has it.\n"
    "Exit codes: 0 stopped by a signal, 1 cannot listen, 2 bad options or a bad --world.";

void define(CLI::App& app, Options& options) {
  app.add_option("--listen", options.listen, "host:port; port 0 takes a free one")->capture_default_str();
  app.add_option("--scenes", options.scenes, "folder of the scene files that clients may name")->check(CLI::ExistingDirectory);
  app.add_option("--world", options.worlds, "scene of --scenes to create and play at once; may be repeated")->needs("--scenes");
  app.add_option("--threads", options.threads, "of each world's step; results do not depend on it")
      ->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--max-worlds", options.max_worlds, "worlds at a time")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_flag("--quiet", options.quiet, "log warnings and errors only");
}

// Creates a world of a named scene; it plays when this returns.
Result<WorldId> begin_world(runtime::WorldRegistry& registry, const runtime::SceneLibrary& scenes, const std::string& name) {
  const auto created = std::make_shared<std::promise<Result<WorldId>>>();  // shared: set_value may outlast get
  registry.create("", [&] { return scenes.load(name); }, [=](Result<WorldId> id) { created->set_value(std::move(id)); });
  const Result<WorldId> id = created->get_future().get();
  if (!id) return id;
  const auto world = registry.find(*id);
  if (!world) return std::unexpected(world.error());
  const auto playing = std::make_shared<std::promise<Result<void>>>();
  (*world)->play(1, [=](Result<void> played) { playing->set_value(std::move(played)); });
  if (const Result<void> played = playing->get_future().get(); !played) return std::unexpected(played.error());
  return id;
}

int serve(const Options& options) {
  // Every thread that follows inherits the mask, so that the signals wait for sigwait below.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  grpc_server::ServerOptions server_options;
  server_options.listen = options.listen;
  server_options.registry.max_worlds = options.max_worlds;
  server_options.registry.runner.threads = options.threads;
  if (!options.scenes.empty()) server_options.scenes = std::make_shared<FolderScenes>(options.scenes);
  const auto scenes = server_options.scenes;
  const auto server = grpc_server::SimulationServer::start(std::move(server_options));
  if (!server) {
    spdlog::error("{}", server.error().text());
    return server.error().code == ErrorCode::invalid_argument ? 2 : 1;
  }
  for (const std::string& name : options.worlds) {
    const Result<WorldId> world = begin_world((*server)->registry(), *scenes, name);
    if (world) continue;
    spdlog::error("--world {}: {}", name, world.error().text());
    return 2;
  }
  std::cout << "crumple-server listens on " << (*server)->address() << std::endl;
  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("stopping on signal {}", signal);
  (*server)->stop();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("crumple-server"));
  Options options;
  CLI::App app(kAbout, "crumple-server");
  define(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (options.quiet) spdlog::set_level(spdlog::level::warn);
  return serve(options);
}
