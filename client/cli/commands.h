#pragma once

#include "client/cli/command_line.h"
#include "client/sdk/simulation_client.h"
#include "common/error.h"

#include <atomic>
#include <iosfwd>
#include <string>

// The commands of `crumple`, one function each, after their options are read.
namespace crumple::cli {

// Options of all commands.
struct Options {
  std::string scene, name, body, file;
  bool on_server = false, play = false, hash = false, absolute = false, events = false, values = false, exact = false;
  WorldId world = 0;
  double speed = 1;
  std::uint32_t steps = 1;
  std::string impulse, force, at;  // "x,y,z"
  double duration = 0;             // [s]
  double radius = -1;              // [m]; < 0: the server's default
  double seconds = 0;              // of wall time; 0: no limit
  std::uint64_t frames = 0;        // 0: no limit
  std::uint64_t until = 0;         // steps of the world; 0: no limit
  double rate = 0;                 // [Hz]; 0: no limit
};

// Why a command failed: an error from the server, or one of this side (a file, an option).
struct Failure {
  Error error;
  ExitCode exit_code;

  Failure(const Error& from_server)  // NOLINT: every error converts
      : error(from_server), exit_code(from_server.code == ErrorCode::unavailable ? kUnreachable : kRefused) {}
  Failure(const Error& own, ExitCode code) : error(own), exit_code(code) {}
};
using Outcome = std::expected<void, Failure>;

using client::SimulationClient;

Outcome create(SimulationClient& client, const Options& options, std::ostream& out);
Outcome scenes(SimulationClient& client, const Options& options, std::ostream& out);
Outcome list(SimulationClient& client, const Options& options, std::ostream& out);
Outcome info(SimulationClient& client, const Options& options, std::ostream& out);
Outcome remove(SimulationClient& client, const Options& options, std::ostream& out);
Outcome play(SimulationClient& client, const Options& options, std::ostream& out);
Outcome pause(SimulationClient& client, const Options& options, std::ostream& out);
Outcome step(SimulationClient& client, const Options& options, std::ostream& out);
Outcome push(SimulationClient& client, const Options& options, std::ostream& out);
Outcome script(SimulationClient& client, const Options& options, std::ostream& out);
Outcome hash(SimulationClient& client, const Options& options, std::ostream& out);

// Until a limit, `stop`, or the end of the world, which is an error.
Outcome watch(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop);
// One line, kept up to date: step, simulated time, real-time factor, viewers. Ends at `until` steps, too.
Outcome progress(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop);
Outcome record(SimulationClient& client, const Options& options, std::ostream& out, const std::atomic<bool>& stop);

// "x,y,z". `field` names the option in the error.
Result<Vec3> parse_vec3(const std::string& text, const std::string& field);

}  // namespace crumple::cli
