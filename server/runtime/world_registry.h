#pragma once

#include "server/runtime/world_runner.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crumple::runtime {

struct RegistryOptions {
  int max_worlds = 16;
  RunnerOptions runner;
};

// All worlds of a server. Thread-safe; no call waits for a world.
class WorldRegistry {
 public:
  explicit WorldRegistry(RegistryOptions options = {});
  ~WorldRegistry();  // ends all worlds and waits for their threads
  WorldRegistry(const WorldRegistry&) = delete;
  WorldRegistry& operator=(const WorldRegistry&) = delete;

  // Makes a paused world on its own thread, which runs make_scene and then calls `created`. `name` may be empty: the
  // scene's. Errors: those of make_scene and of World::create; resource_exhausted at max_worlds; unavailable once closed.
  void create(std::string name, WorldRunner::MakeScene make_scene, Done<WorldId> created);

  // Error not_found. The reference may be kept for the length of a call, not on the world's own thread.
  Result<std::shared_ptr<WorldRunner>> find(WorldId id) const;
  std::vector<WorldStatus> list() const;  // by id

  // Ends a world: its readers and callers get not_found. Error not_found.
  Result<void> remove(WorldId id);
  // Ends all worlds with `reason` and refuses new ones.
  void close(Error reason);

 private:
  void reap();
  void discard(std::shared_ptr<WorldRunner> runner);

  const RegistryOptions options_;
  mutable std::mutex mutex_;
  std::map<WorldId, std::shared_ptr<WorldRunner>> worlds_;
  WorldId last_id_ = 0;
  std::optional<Error> closed_;

  // Runners that are ending are destroyed, which waits for their threads, here.
  std::condition_variable wake_;
  std::vector<std::shared_ptr<WorldRunner>> ending_;
  bool stop_ = false;
  std::thread reaper_;
};

}  // namespace crumple::runtime
