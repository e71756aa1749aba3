#pragma once

#include "common/error.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

namespace crumple::runtime {

// Scenes that calls name instead of bringing them. Thread-safe.
class SceneLibrary {
 public:
  virtual ~SceneLibrary() = default;
  virtual std::vector<std::string> names() const = 0;  // sorted
  // Errors: invalid_argument for a name that is not plain and for a bad scene, not_found.
  virtual Result<sim::SceneDescription> load(const std::string& name) const = 0;
};

}  // namespace crumple::runtime
