#include "client/cli/command_line.h"

#include <CLI/CLI.hpp>

#include <functional>
#include <ostream>

#include "client/cli/commands.h"

namespace crumple::cli {
namespace {

constexpr const char* kAbout =
    "Talks to a crumple-server: creates worlds, steps, pushes, watches and records them.";
constexpr const char* kFooter =
    "Worlds are named by the number that `create` prints and `list` shows. Vectors are x,y,z in SI units, y up.\n"
    "Exit codes: 0 done, 1 the server refused (the reason is printed), 2 bad usage or a bad local file,\n"
    "3 no server answers.";
constexpr const char* kRecordAbout =
    "Saves the stream to a file: messages crumple.v1.WatchResponse (proto/crumple/v1/simulation.proto), each behind its "
    "length as a protobuf varint; payloads as in common/frame_codec.h";

using Action = std::function<Outcome(SimulationClient&)>;

struct CommandLine {
  CLI::App app{kAbout, "crumple"};
  std::string server = "127.0.0.1:50061";
  double timeout = 60;
  Options options;
  Action action;  // of the command that was given
  std::ostream& out;
  const std::atomic<bool>& stop;

  using Plain = Outcome (*)(SimulationClient&, const Options&, std::ostream&);
  using Stoppable = Outcome (*)(SimulationClient&, const Options&, std::ostream&, const std::atomic<bool>&);

  CLI::App* command(const std::string& name, const std::string& about, Plain function) {
    CLI::App* sub = app.add_subcommand(name, about);
    sub->callback([this, function] { action = [=, this](SimulationClient& c) { return function(c, options, out); }; });
    return sub;
  }
  CLI::App* command(const std::string& name, const std::string& about, Stoppable function) {
    CLI::App* sub = app.add_subcommand(name, about);
    sub->callback([this, function] { action = [=, this](SimulationClient& c) { return function(c, options, out, stop); }; });
    return sub;
  }
  CLI::App* on_world(CLI::App* sub) {
    sub->add_option("WORLD", options.world, "number of the world")->required();
    return sub;
  }
  void stream_options(CLI::App* sub) {
    sub->add_option("--frames", options.frames, "end after so many frames");
    sub->add_option("--seconds", options.seconds, "end after so much wall time [s]")->check(CLI::NonNegativeNumber);
    sub->add_option("--rate", options.rate, "at most so many frames a second")->check(CLI::Range(0.0, 1000.0));
    sub->add_flag("--values", options.values, "with values of each vertex: stress, or the weights of its examples");
    sub->add_flag("--exact", options.exact, "positions in 32-bit floats instead of 16 quantised bits");
  }

  void define() {
    app.footer(kFooter);
    app.require_subcommand(1);
    app.add_option("--server", server, "host:port")->capture_default_str();
    app.add_option("--timeout", timeout, "for an answer, except to step, watch, progress and record [s]")
        ->check(CLI::PositiveNumber)->capture_default_str();

    CLI::App* sub = command("create", "Creates a paused world and prints its number", create);
    sub->add_option("SCENE", options.scene,
                    "a scene file here, which then must not name other files; else the name of one on the server")->required();
    sub->add_option("--name", options.name, "of the world; default: the scene's");
    sub->add_flag("--on-server", options.on_server, "SCENE is a name on the server, even if such a file is here");
    sub->add_flag("--play", options.play, "and lets it run");
    command("scenes", "Names the scenes on the server", scenes);
    command("list", "Shows all worlds", list);
    on_world(command("info", "Shows a world and its bodies", info));
    on_world(command("delete", "Ends a world", remove));
    sub = on_world(command("play", "Lets the clock run", play));
    sub->add_option("--speed", options.speed, "simulated over wall time")->capture_default_str();
    on_world(command("pause", "Stops the clock and prints the step", pause));
    sub = on_world(command("step", "Takes N steps in lockstep; the world must be paused", step));
    sub->add_option("N", options.steps, "steps")->capture_default_str();
    sub->add_flag("--hash", options.hash, "and prints the hash of the state");
    sub = on_world(command("push", "Applies an impulse or a force to a body at a point", push));
    sub->add_option("BODY", options.body, "name of the body")->required();
    sub->add_option("--impulse", options.impulse, "x,y,z [N s]");
    sub->add_option("--force", options.force, "x,y,z [N]");
    sub->add_option("--at", options.at, "x,y,z in the world [m]")->required();
    sub->add_option("--duration", options.duration, "of the force [s]; 0: one step");
    sub->add_option("--radius", options.radius, "finite-element bodies: nodes within take part [m]; default 0.1");
    sub = on_world(command("script", "Runs timed commands from a file", script));
    sub->add_option("FILE", options.file,
                    "JSON: {\"commands\": [{\"time\": 0.5, \"command\": {\"apply_impulse\": {...}}}, ...]}")->required();
    sub->add_flag("--absolute", options.absolute, "times count from the world's begin instead of from now");
    sub = on_world(command("watch", "Prints step, time, real-time factor and step time of each frame", watch));
    stream_options(sub);
    sub->add_flag("--events", options.events, "and the events and topologies");
    sub = on_world(command("progress", "Keeps one line up to date: step, time, real-time factor, viewers", progress));
    sub->add_option("--until", options.until, "ends when the world has taken so many steps");
    sub = on_world(command("record", kRecordAbout, record));
    sub->add_option("FILE", options.file, "to write")->required();
    stream_options(sub);
    on_world(command("hash", "Prints the hash of a world's state", hash));
  }
};

int report(const Failure& failure, std::ostream& err) {
  err << "crumple: " << failure.error.text() << '\n';
  return failure.exit_code;
}

}  // namespace

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err, const std::atomic<bool>& stop) {
  CommandLine line{.out = out, .stop = stop};
  line.define();
  try {
    line.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return line.app.exit(error, out, err) == 0 ? kOk : kUsage;
  }
  client::ConnectOptions connect;
  connect.call_timeout = std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * line.timeout));
  connect.connect_timeout = std::min(connect.connect_timeout, connect.call_timeout);
  const auto client = client::connect(line.server, connect);
  if (!client) return report(client.error(), err);
  const Outcome done = line.action(**client);
  return done ? kOk : report(done.error(), err);
}

}  // namespace crumple::cli
