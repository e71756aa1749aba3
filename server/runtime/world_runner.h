#pragma once

#include "common/error.h"
#include "common/world_status.h"
#include "server/runtime/frame_hub.h"
#include "server/runtime/step_clock.h"
#include "server/runtime/wall_clock.h"
#include "server/sim/world.h"

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace crumple::runtime {

// Called once, on the world's thread or, if the world has ended, on the caller's; must be quick.
template <class T>
using Done = std::function<void(Result<T>)>;

struct RunnerOptions {
  int threads = 1;                     // of the world's step
  std::size_t event_capacity = 16384;
  double max_owed = 0.1;               // [s], of StepClock
  std::size_t max_content = kMaxContentBytes;  // of a message to a reader, before compression [bytes]
  std::shared_ptr<WallClock> clock = steady_wall_clock();
};

// One world and the thread that owns it: steps it by the clock or on order, serves commands between steps, publishes
// frames and events. What a library throws ends here: the world is marked failed, its readers and callers are told,
// and no other world notices.
//
// Orders (all but info) are served in the order of their arrival; none of the calls waits. Errors of every order: the
// reason the world ended; internal if it failed.
class WorldRunner {
 public:
  using MakeScene = std::function<Result<sim::SceneDescription>()>;  // runs on the world's thread
  using MakeCommand = std::function<Result<sim::Command>(const sim::World&)>;
  using MakeScript = std::function<Result<std::vector<sim::ScriptedCommand>>(const sim::World&)>;

  // `name` may be empty: the scene's. `created` is called when the world stands, paused, or could not be made.
  WorldRunner(WorldId id, std::string name, MakeScene make_scene, const RunnerOptions& options, Done<WorldId> created);
  ~WorldRunner();  // ends it and waits for its thread: not on that thread
  WorldRunner(const WorldRunner&) = delete;
  WorldRunner& operator=(const WorldRunner&) = delete;

  static constexpr double kMinSpeed = 1e-3, kMaxSpeed = 1e3;
  static constexpr std::uint32_t kMaxSteps = 1'000'000;
  static constexpr std::size_t kMaxScript = 100'000;

  void play(double speed, Done<void> done);    // invalid: speed, in [kMinSpeed, kMaxSpeed]
  void pause(Done<std::uint64_t> done);        // also ends the steps ordered before it; answers the step count
  void step(std::uint32_t steps, bool want_hash, Done<StepSummary> done);  // invalid: steps; precondition: it plays
  void submit(MakeCommand make, Done<std::uint64_t> done);  // as World::submit; answers the step it acts in
  // As World::schedule. Times count from the world's begin if absolute, else from now. Answers now.
  void schedule(MakeScript make, bool absolute, Done<double> done);
  void info(bool want_bodies, bool want_hash, Done<WorldInfo> done);  // between two steps, before waiting orders

  WorldStatus status() const;  // of the last step; never waits for one
  bool created() const;        // the world stands or has failed later
  FrameHub& hub() { return hub_; }

  // Ends the world with `reason`: readers and waiting callers get it at once. Does not wait.
  void end(Error reason);

 private:
  struct Order {
    std::uint64_t number = 0;
    std::function<void(std::uint64_t number)> serve;
    std::function<void(Error)> refuse;
  };
  struct Stepping {  // a step order that is running
    std::uint64_t number = 0;
    std::uint32_t wanted = 0;
    bool want_hash = false;
    double begin = 0;
    StepSummary summary;
    Done<StepSummary> done;
  };

  std::uint64_t post(Order order, std::deque<Order>& queue);
  void run(const MakeScene& make_scene, const Done<WorldId>& created);
  Result<void> create(const MakeScene& make_scene);
  void loop();
  void serve(std::deque<Order>& queue, std::unique_lock<std::mutex>& lock);
  void take_step();
  void account(const sim::StepReport& report);
  void finish_stepping();
  void publish_if_wanted();
  void refresh_status();
  void fail(const std::string& what);
  void refuse_all();

  const WorldId id_;
  const RunnerOptions options_;
  std::string name_;

  // ---- the world's thread only
  std::unique_ptr<sim::World> world_;
  std::unique_ptr<StepClock> clock_;
  std::unique_ptr<Stepping> stepping_;
  std::shared_ptr<const PublishedTopology> topology_;
  double step_ms_ = 0;

  // ---- shared, under mutex_
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Order> orders_, queries_;
  std::uint64_t last_number_ = 0;
  bool demand_changed_ = false;
  bool created_ = false;
  std::optional<Error> end_;
  WorldStatus status_;
  std::uint64_t pause_number_ = 0;  // of the last pause order

  FrameHub hub_;
  std::thread thread_;  // last: it starts when all else is there
};

}  // namespace crumple::runtime
