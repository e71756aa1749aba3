#pragma once

#include "server/runtime/scene_library.h"

#include <filesystem>

namespace crumple {

// The scene files of a folder, with what they name from it. A name is a file's, with or without ".json"; it is plain:
// no folders, no "..", no leading dot.
class FolderScenes final : public runtime::SceneLibrary {
 public:
  explicit FolderScenes(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::vector<std::string> names() const override;
  Result<sim::SceneDescription> load(const std::string& name) const override;

 private:
  std::filesystem::path folder_;
};

}  // namespace crumple
