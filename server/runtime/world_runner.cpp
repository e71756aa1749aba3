#include "server/runtime/world_runner.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cassert>
#include <new>

#include "common/text.h"

namespace crumple::runtime {

WorldRunner::WorldRunner(WorldId id, std::string name, MakeScene make_scene, const RunnerOptions& options,
                         Done<WorldId> created)
    : id_(id), options_(options), name_(std::move(name)),
      hub_(options.clock, options.event_capacity,
           [this] {
             const std::lock_guard lock(mutex_);
             demand_changed_ = true;
             wake_.notify_all();
           }),
      thread_([this, make = std::move(make_scene), done = std::move(created)] { run(make, done); }) {}

WorldRunner::~WorldRunner() {
  assert(std::this_thread::get_id() != thread_.get_id());
  end({ErrorCode::not_found, "", text("world ", id_, " is gone")});
  thread_.join();
}

// ---- orders ---------------------------------------------------------------------------------------------------------

// Queues the order, or refuses it if the world has ended.
std::uint64_t WorldRunner::post(Order order, std::deque<Order>& queue) {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = order.number = ++last_number_;
  if (end_) {
    const Error reason = *end_;
    lock.unlock();
    order.refuse(reason);
  } else {
    queue.push_back(std::move(order));
    wake_.notify_all();
  }
  return number;
}

void WorldRunner::play(double speed, Done<void> done) {
  if (!(speed >= kMinSpeed && speed <= kMaxSpeed))
    return done(invalid("speed", text("is ", speed, ", must lie in [", kMinSpeed, ", ", kMaxSpeed, "]")));
  const auto serve = [=, this](std::uint64_t) {
    clock_->play(options_.clock->now(), speed);
    refresh_status();
    done({});
  };
  post({0, serve, [=](Error error) { done(std::unexpected(error)); }}, orders_);
}

void WorldRunner::pause(Done<std::uint64_t> done) {
  const auto serve = [=, this](std::uint64_t) {
    clock_->pause();
    refresh_status();
    done(world_->step_count());
  };
  const std::uint64_t number = post({0, serve, [=](Error error) { done(std::unexpected(error)); }}, orders_);
  const std::lock_guard lock(mutex_);
  pause_number_ = std::max(pause_number_, number);
}

void WorldRunner::step(std::uint32_t steps, bool want_hash, Done<StepSummary> done) {
  if (steps < 1 || steps > kMaxSteps)
    return done(invalid("steps", text("is ", steps, ", must lie in [1, ", kMaxSteps, "]")));
  const auto serve = [=, this](std::uint64_t number) {
    if (clock_->playing()) {
      const std::string message = text("world ", id_, " plays: pause it before stepping");
      return done(std::unexpected(Error{ErrorCode::failed_precondition, "", message}));
    }
    stepping_ = std::make_unique<Stepping>(number, steps, want_hash, options_.clock->now(), StepSummary{}, done);
    refresh_status();
  };
  post({0, serve, [=](Error error) { done(std::unexpected(error)); }}, orders_);
}

void WorldRunner::submit(MakeCommand make, Done<std::uint64_t> done) {
  const auto serve = [=, this](std::uint64_t) {
    const Result<sim::Command> command = make(*world_);
    if (!command) return done(std::unexpected(command.error()));
    const Result<void> accepted = world_->submit(*command);
    if (!accepted) return done(std::unexpected(accepted.error()));
    done(world_->step_count() + 1);
  };
  post({0, serve, [=](Error error) { done(std::unexpected(error)); }}, orders_);
}

void WorldRunner::schedule(MakeScript make, bool absolute, Done<double> done) {
  const auto serve = [=, this](std::uint64_t) {
    Result<std::vector<sim::ScriptedCommand>> script = make(*world_);
    if (!script) return done(std::unexpected(script.error()));
    if (!absolute)
      for (sim::ScriptedCommand& command : *script) command.time += world_->time();
    const Result<void> accepted = world_->schedule(*script);
    if (!accepted) return done(std::unexpected(accepted.error()));
    done(world_->time());
  };
  post({0, serve, [=](Error error) { done(std::unexpected(error)); }}, orders_);
}

void WorldRunner::info(bool want_bodies, bool want_hash, Done<WorldInfo> done) {
  const auto serve = [=, this](std::uint64_t) {
    WorldInfo info{status(), {}, want_hash ? world_->state_hash() : 0};
    if (want_bodies) {
      for (const BodyTopology& body : world_->topology().bodies)
        info.bodies.push_back({body.id, body.name, body.model, world_->pose(body.id), world_->velocity(body.id), world_->is_asleep(body.id)});
    }
    done(std::move(info));
  };
  const auto refuse = [=, this](Error error) {
    WorldStatus last = status();
    if (last.state != WorldState::failed) return done(std::unexpected(error));
    done(WorldInfo{std::move(last), {}, 0});
  };
  post({0, serve, refuse}, queries_);
}

WorldStatus WorldRunner::status() const {
  std::unique_lock lock(mutex_);
  WorldStatus status = status_;
  lock.unlock();
  status.viewers = hub_.readers();
  return status;
}

bool WorldRunner::created() const {
  const std::lock_guard lock(mutex_);
  return created_;
}

void WorldRunner::end(Error reason) {
  hub_.close(reason);
  const std::lock_guard lock(mutex_);
  if (!end_) end_ = std::move(reason);
  wake_.notify_all();
}

// ---- the world's thread -----------------------------------------------------------------------------------------------

void WorldRunner::run(const MakeScene& make_scene, const Done<WorldId>& created) {
  Result<void> made;
  try {
    made = create(make_scene);
  } catch (const std::bad_alloc&) {
    made = std::unexpected(Error{ErrorCode::resource_exhausted, "", "the scene does not fit into memory"});
  } catch (const std::exception& thrown) {
    made = std::unexpected(Error{ErrorCode::internal, "", text("making the world failed: ", thrown.what())});
  }
  if (!made) {
    world_.reset();
    end(made.error());
    refuse_all();
    return created(std::unexpected(made.error()));
  }
  created(id_);
  try {
    loop();
  } catch (const std::exception& thrown) {
    fail(thrown.what());
  } catch (...) {
    fail("an exception of unknown type");
  }
  refuse_all();
}

Result<void> WorldRunner::create(const MakeScene& make_scene) {
  Result<sim::SceneDescription> scene = make_scene();
  if (!scene) return std::unexpected(scene.error());
  if (name_.empty()) name_ = scene->name;
  auto world = sim::World::create(*scene, {.threads = options_.threads});
  if (!world) return std::unexpected(world.error());
  world_ = std::move(*world);
  clock_ = std::make_unique<StepClock>(world_->dt(), options_.max_owed);
  hub_.append(world_->take_events());
  refresh_status();
  const std::lock_guard lock(mutex_);
  created_ = true;
  return {};
}

void WorldRunner::loop() {
  std::unique_lock lock(mutex_);
  while (!end_) {
    serve(queries_, lock);
    while (!stepping_ && !orders_.empty() && !end_) serve(orders_, lock);
    if (end_) break;
    demand_changed_ = false;
    const bool paused = stepping_ && stepping_->number < pause_number_;
    lock.unlock();
    const bool due = clock_->playing() && options_.clock->now() >= clock_->next_step_at();
    if (paused) {
      finish_stepping();
    } else if (stepping_ || due) {
      take_step();
    } else {
      publish_if_wanted();
    }
    lock.lock();
    if (end_ || stepping_ || !queries_.empty() || !orders_.empty() || demand_changed_) continue;
    options_.clock->wait_until(lock, wake_, clock_->playing() ? clock_->next_step_at() : WallClock::kForever);
  }
}

// Serves the queue's first order, if there is one.
void WorldRunner::serve(std::deque<Order>& queue, std::unique_lock<std::mutex>& lock) {
  if (queue.empty()) return;
  const Order order = std::move(queue.front());
  queue.pop_front();
  lock.unlock();
  try {
    order.serve(order.number);
  } catch (...) {
    order.refuse({ErrorCode::internal, "", text("world ", id_, " failed in this call")});
    throw;
  }
  lock.lock();
}

void WorldRunner::take_step() {
  const double begin = options_.clock->now();
  const sim::StepReport report = world_->step();
  const double now = options_.clock->now();
  step_ms_ = 1e3 * (now - begin);
  if (clock_->playing()) clock_->stepped(now);
  hub_.append(world_->take_events());
  refresh_status();
  publish_if_wanted();
  if (!stepping_) return;
  account(report);
  if (stepping_->summary.steps == stepping_->wanted) finish_stepping();
}

void WorldRunner::account(const sim::StepReport& report) {
  StepSummary& sum = stepping_->summary;
  ++sum.steps;
  sum.contacts += report.contacts;
  sum.solver_iterations += report.solver_iterations;
  sum.capped_solves += report.capped_solves;
  sum.splits += report.splits;
  sum.plastic_impulses += report.plastic_impulses;
  sum.worst_residual = std::max(sum.worst_residual, report.worst_residual);
  sum.worst_penetration = std::max(sum.worst_penetration, report.worst_penetration);
}

void WorldRunner::finish_stepping() {
  StepSummary& sum = stepping_->summary;
  sum.step = world_->step_count();
  sum.time = world_->time();
  sum.wall_ms = 1e3 * (options_.clock->now() - stepping_->begin);
  if (stepping_->want_hash) sum.state_hash = world_->state_hash();
  const std::unique_ptr<Stepping> finished = std::move(stepping_);
  refresh_status();
  finished->done(finished->summary);
}

void WorldRunner::publish_if_wanted() {
  const FrameHub::Demand demand = hub_.demand(world_->step_count());
  if (!demand.frame) return;
  if (!topology_ || topology_->topology().epoch != world_->topology().epoch) {
    if (const auto what = too_long(world_->topology(), options_.max_content))
      return hub_.close({ErrorCode::resource_exhausted, "", text("world ", id_, " cannot be watched any more: ", *what)});
    topology_ = std::make_shared<PublishedTopology>(world_->topology(), topology_.get(), options_.max_content);
  }
  Frame frame = world_->capture(demand.values);
  frame.step_ms = step_ms_;
  frame.real_time_factor = clock_->real_time_factor();
  hub_.publish(std::make_shared<PublishedFrame>(std::move(frame), demand.values, topology_));
}

void WorldRunner::refresh_status() {
  WorldStatus status;
  status.id = id_;
  status.name = name_;
  status.state = stepping_ ? WorldState::stepping : clock_->playing() ? WorldState::playing : WorldState::paused;
  status.step = world_->step_count();
  status.time = world_->time();
  status.dt = world_->dt();
  status.real_time_factor = clock_->real_time_factor();
  status.step_ms = step_ms_;
  status.dropped_seconds = clock_->dropped_seconds();
  status.bodies = world_->body_count();
  status.asleep = world_->workload().asleep_bodies;
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

void WorldRunner::fail(const std::string& what) {
  spdlog::error("world={} step={} failed: {}", id_, world_->step_count(), what);
  const Error error{ErrorCode::internal, "", text("world ", id_, " failed: ", what)};
  {
    const std::lock_guard lock(mutex_);
    status_.state = WorldState::failed;
    status_.real_time_factor = 0;
    status_.failure = what;
  }
  end(error);
}

void WorldRunner::refuse_all() {
  std::unique_lock lock(mutex_);
  assert(end_);
  const Error reason = *end_;
  std::deque<Order> left = std::move(orders_);
  orders_.clear();
  for (Order& query : queries_) left.push_back(std::move(query));
  queries_.clear();
  lock.unlock();
  if (stepping_) std::exchange(stepping_, nullptr)->done(std::unexpected(reason));
  for (const Order& order : left) order.refuse(reason);
}

}  // namespace crumple::runtime
