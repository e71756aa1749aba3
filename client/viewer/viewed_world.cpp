#include "client/viewer/viewed_world.h"

namespace crumple::viewer {

ViewedWorld::ViewedWorld(client::SimulationClient& client, WorldId world, std::string scene_file)
    : client_(client), scene_file_(std::move(scene_file)), world_(world) {}

WorldId ViewedWorld::id() const {
  const std::lock_guard lock(mutex_);
  return world_;
}

Result<void> ViewedWorld::restart() {
  const std::lock_guard lock(mutex_);
  if (scene_file_.empty()) {
    return std::unexpected(Error{ErrorCode::failed_precondition, "", "this viewer watches a world of somebody else, which it does not restart"});
  }
  auto fresh = client_.create_world_from_file(scene_file_);
  if (!fresh) return std::unexpected(fresh.error());
  const WorldId old = world_;
  world_ = *fresh;
  if (auto playing = client_.play(world_); !playing) return playing;
  return client_.delete_world(old);
}

}  // namespace crumple::viewer
