#pragma once

#include "client/sdk/simulation_client.h"

#include <memory>
#include <mutex>
#include <string>

namespace crumple::viewer {

// The one world that a viewer shows to all its pages. Thread-safe. A restart replaces it by a fresh one of the same
// scene file; pages then find their stream ended and take up the new one.
class ViewedWorld {
 public:
  // Takes an existing world, or, if `scene_file` is not empty, can also make it anew.
  ViewedWorld(client::SimulationClient& client, WorldId world, std::string scene_file);

  client::SimulationClient& client() const { return client_; }
  WorldId id() const;
  Result<void> restart();  // failed_precondition: the world was not made from a scene file by this viewer

 private:
  client::SimulationClient& client_;
  const std::string scene_file_;
  mutable std::mutex mutex_;
  WorldId world_;
};

}  // namespace crumple::viewer
