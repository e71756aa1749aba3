#pragma once

#include "common/error.h"
#include "common/frame.h"
#include "server/sim/event.h"
#include "server/sim/example_based/example_rest.h"
#include "server/sim/example_based/example_times.h"
#include "server/sim/scene.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace crumple::sim {

struct WorldOptions {
  int threads = 1;          // bits do not depend on it
  bool invariants = false;  // keep World::invariants(); the state does not depend on it
  bool strikes = false;     // keep World::strikes(); the same
  double rigid_tolerance = 0;  // for studies: of the rigid solver (RigidSettings) [m/s]; 0: its own
};

// An impulse of rigid contact on an example-based body.
struct Strike {
  BodyId body = 0;
  double impulse = 0;  // |j| [N s]
};

// Names and wall times are the lines of World::step; the clock belongs to the caller (`StageClock`).
struct StageTime {
  const char* name;
  double ms;
};

// What a world is busy with, and what it is spared [Parker & O'Brien 2009, figure 8]: bodies that can move, and tets and
// nodes of finite-element ones. Bodies that are wholly scripted or held are neither live nor asleep.
struct Workload {
  int live_bodies = 0, asleep_bodies = 0;
  int live_tets = 0, asleep_tets = 0;
  int live_nodes = 0, asleep_nodes = 0;
  int rigid_fragments = 0;   // of finite-element bodies, asleep or not; their tets and nodes are not counted above
  int asleep_fragments = 0;  // of these
};

struct StepReport {
  std::uint64_t step = 0;
  int contacts = 0;              // rows between soft bodies and anything
  int solver_iterations = 0;     // sum over the islands
  double worst_residual = 0;     // relative
  int capped_solves = 0;         // solves that ended at their cap
  int rough_bodies = 0;          // that stepped by backward Euler where the scene's integrator is BDF2
  int splits = 0;                // nodes split by fracture
  int plastic_impulses = 0;      // above beta
  int broken_joints = 0;
  int rigid_sweeps = 0;          // of the rigid solver
  double rigid_residual = 0;     // what the last of them still changed [m/s]
  double worst_penetration = 0;  // deepest contact found at the start of the step [m]
  Workload workload;             // at its end
};

struct Energies {
  double kinetic = 0, elastic = 0, gravitational = 0;  // [J]
  Vec3 momentum = Vec3::Zero();                        // [kg m/s]
  Vec3 angular_momentum = Vec3::Zero();                // about the origin of W [kg m^2/s]
};

// What a world has after a step, and the work that was done on what moves in that step. Energy changes by this work, less
// what plastic flow, fracture, damping and the integrator take.
struct Invariants {
  Energies energies;
  // Of contact impulses, friction and the recovery of overlaps included, on all nodes and bodies that move freely [J].
  // Negative but where a scripted body pushes or an overlap is taken back.
  double contact_work = 0;
  double command_work = 0;     // of clients' and scripted commands [J]
  double prescribed_work = 0;  // of scripts on their nodes: on the elements that hang on them, by the force at the step's
                               // end, and on the nodes' own mass [J]
};

// What a recording or a test reads of one finite-element body. Tets are those of the scene's mesh in its order, however it broke;
// nodes those of its deformable pieces, then of rigid fragments, whose stress is not known and given as 0.
struct FemView {
  std::vector<Tet> tets;
  std::vector<Vec3> x;
  std::vector<Vec3> v;
  std::vector<Mat3> plastic_strain;
  std::vector<std::uint16_t> material_id;  // one a tet: 0 the body's, k that of region k - 1; empty: all 0
  std::vector<double> von_mises;  // one a tet [Pa]
  int inverted = 0;               // tets of negative volume
  int fragments = 0;              // face-connected components
  int rigid_fragments = 0;        // of them
};

// A world: bodies of all models in one space. Deterministic: the same scene and commands give the same bits, whatever
// the number of threads. Not thread-safe; one thread owns it.
class World {
 public:
  // Fails like validate(scene).
  static Result<std::unique_ptr<World>> create(const SceneDescription& scene, const WorldOptions& options = {});
  ~World();

  // Takes effect at the start of the next step. Errors: unknown body, node ids out of range, non-finite or beyond the
  // limits of command.h, a fixed body. Nothing changes on error.
  Result<void> submit(const Command& command);

  // Adds to the scene's script while the world runs: each command at the first step whose start is at or after its
  // `time`, commands of equal time in the order given; times already past at the next step. Errors: like submit, the
  // field being `script[i]...`, and a time that is not in [0, 1e9]. All commands are taken or none.
  Result<void> schedule(const std::vector<ScriptedCommand>& script);

  // One step of scene.dt. `now_ms`, if given, is called between stages to fill stage_times().
  StepReport step();
  void set_clock(double (*now_ms)());
  const std::vector<StageTime>& stage_times() const;  // of the last step
  // Inside the stage "examples" of the last step, summed over the bodies; if there is a clock.
  const example_based::ExampleTimes& example_times() const;

  double time() const;
  std::uint64_t step_count() const;
  double dt() const;
  int body_count() const;
  BodyId find(const std::string& name) const;  // body_count() if there is none
  Pose pose(BodyId body) const;                // X_WB of the body's axes as in the scene; FEM: its mean position
  Vec3 velocity(BodyId body) const;            // of the centre of mass [m/s]
  bool is_asleep(BodyId body) const;           // held where it is until something wakes it (SleepSettings)
  Workload workload() const;

  const Topology& topology() const;
  Frame capture(bool with_values = false) const;
  std::vector<Event> take_events();            // since the last call, in order

  Energies energies() const;
  Invariants invariants() const;               // of the last step; zero work without WorldOptions::invariants
  const std::vector<Strike>& strikes() const;  // of the last step; empty without WorldOptions::strikes
  FemView fem(BodyId body) const;              // body must be a finite-element body
  int inverted(BodyId body) const;             // FemView::inverted alone, which costs no more than it has to
  const example_based::WeightMatrix& example_weights(BodyId body) const;  // E, N x E; body must be example-based

  // 64 bits over every double of the state, bit for bit.
  std::uint64_t state_hash() const;

 private:
  World();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crumple::sim
