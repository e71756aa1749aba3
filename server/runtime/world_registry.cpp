#include "server/runtime/world_registry.h"

#include <spdlog/spdlog.h>

#include "common/text.h"


namespace crumple::runtime {

WorldRegistry::WorldRegistry(RegistryOptions options) : options_(std::move(options)), reaper_([this] { reap(); }) {}

WorldRegistry::~WorldRegistry() {
  close({ErrorCode::unavailable, "", "the server is stopping"});
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, runner] : worlds_) ending_.push_back(std::move(runner));
    worlds_.clear();
    stop_ = true;
  }
  wake_.notify_all();
  reaper_.join();
}

void WorldRegistry::create(std::string name, WorldRunner::MakeScene make_scene, Done<WorldId> created) {
  std::unique_lock lock(mutex_);
  std::optional<Error> error = closed_;
  if (!error && static_cast<int>(worlds_.size()) >= options_.max_worlds)
    error = Error{ErrorCode::resource_exhausted, "",
                  text("the server holds ", worlds_.size(), " worlds, as many as it may")};
  if (error) {
    lock.unlock();
    return created(std::unexpected(*error));
  }
  const WorldId id = ++last_id_;
  const auto finish = [this, id, created = std::move(created)](Result<WorldId> result) {
    if (result) {
      spdlog::info("world={} created", id);
    } else {
      std::unique_lock finish_lock(mutex_);
      if (auto node = worlds_.extract(id)) discard(std::move(node.mapped()));
    }
    created(std::move(result));
  };
  worlds_[id] = std::make_shared<WorldRunner>(id, std::move(name), std::move(make_scene), options_.runner, finish);
}

Result<std::shared_ptr<WorldRunner>> WorldRegistry::find(WorldId id) const {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(id);
  if (found == worlds_.end() || !found->second->created())
    return std::unexpected(Error{ErrorCode::not_found, "world", text("is ", id, ", there is no such world")});
  return found->second;
}

std::vector<WorldStatus> WorldRegistry::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<WorldStatus> list;
  for (const auto& [id, runner] : worlds_)
    if (runner->created()) list.push_back(runner->status());
  return list;
}

Result<void> WorldRegistry::remove(WorldId id) {
  const auto runner = find(id);
  if (!runner) return std::unexpected(runner.error());
  (*runner)->end({ErrorCode::not_found, "", text("world ", id, " was deleted")});
  spdlog::info("world={} deleted", id);
  const std::lock_guard lock(mutex_);
  if (auto node = worlds_.extract(id)) discard(std::move(node.mapped()));
  return {};
}

void WorldRegistry::close(Error reason) {
  const std::lock_guard lock(mutex_);
  if (!closed_) closed_ = reason;
  for (auto& [id, runner] : worlds_) runner->end(reason);
}

// Needs the lock.
void WorldRegistry::discard(std::shared_ptr<WorldRunner> runner) {
  ending_.push_back(std::move(runner));
  wake_.notify_all();
}

void WorldRegistry::reap() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stop_ || !ending_.empty(); });
    if (ending_.empty()) return;
    std::vector<std::shared_ptr<WorldRunner>> ending = std::move(ending_);
    ending_.clear();
    lock.unlock();
    ending.clear();
    lock.lock();
  }
}

}  // namespace crumple::runtime
