#pragma once

#include "client/sdk/watch_stream.h"
#include "common/error.h"
#include "common/world_status.h"
#include "crumple/v1/scene.pb.h"

#include <chrono>
#include <memory>
#include <string>
#include <vector>

namespace crumple::client {

// A simulation server as a client sees it, whatever the transport: over gRPC (connect) or in the same process
// (in_process). Thread-safe. Errors are those that simulation.proto documents with each method, and
//   unavailable  the server cannot be reached, is stopping, or did not answer in time
class SimulationClient {
 public:
  virtual ~SimulationClient() = default;

  // `name` may be empty: the scene's.
  virtual Result<WorldId> create_world(const v1::Scene& scene, const std::string& name = "") = 0;
  virtual Result<WorldId> create_world_from_file(const std::string& scene_file, const std::string& name = "") = 0;
  virtual Result<std::vector<WorldStatus>> list_worlds() = 0;
  virtual Result<std::vector<std::string>> list_scenes() = 0;
  virtual Result<WorldInfo> world(WorldId world, bool bodies = false, bool state_hash = false) = 0;
  virtual Result<void> delete_world(WorldId world) = 0;

  virtual Result<void> play(WorldId world, double speed = 1) = 0;
  virtual Result<std::uint64_t> pause(WorldId world) = 0;  // answers the step it stands at
  virtual Result<StepSummary> step(WorldId world, std::uint32_t steps, bool state_hash = false) = 0;

  virtual Result<std::uint64_t> apply(WorldId world, const v1::Command& command) = 0;  // answers the step it acts in
  // Times count from the world's begin if absolute, else from the time that is answered [s].
  virtual Result<double> run_script(WorldId world, const std::vector<v1::ScriptedCommand>& commands,
                                    bool absolute = false) = 0;

  virtual Result<std::unique_ptr<WatchStream>> watch(WorldId world, const WatchOptions& options = {}) = 0;
};

struct ConnectOptions {
  std::chrono::milliseconds connect_timeout{5000};
  std::chrono::milliseconds call_timeout{60'000};  // of every call but step and watch, which may take any time
};

// Connects to "host:port", in plain text. Error unavailable.
Result<std::unique_ptr<SimulationClient>> connect(const std::string& address, const ConnectOptions& options = {});

// Commands as messages.
v1::Command impulse_command(const std::string& body, const Vec3& impulse, const Vec3& point);
v1::Command force_command(const std::string& body, const Vec3& force, const Vec3& point, double duration);

}  // namespace crumple::client
