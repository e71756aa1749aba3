#pragma once

#include "server/sim/bodies/example_body.h"
#include "server/sim/bodies/fem_object.h"
#include "server/sim/bodies/soft_body.h"
#include "server/sim/bodies/solid_body.h"
#include "server/sim/guard/island_guard.h"
#include "server/sim/contact/detect.h"
#include "server/sim/contact/lasting_rows.h"
#include "server/sim/contact/sweep_and_prune.h"
#include "server/sim/islands/composite_island.h"
#include "server/sim/islands/sleep.h"
#include "server/sim/islands/stillness.h"
#include "server/sim/parallel_for.h"
#include "server/sim/rigid/load_window.h"
#include "server/sim/rigid/rigid_world.h"
#include "server/sim/world.h"

// Private to world*.cpp: what a world is made of. The stages of a step are its member functions, in the order in which
// World::step calls them; docs/architecture.md has a section for each.
namespace crumple::sim {

struct World::Impl {
  explicit Impl(const WorldOptions& options, const RigidSettings& settings)
      : keeps_invariants(options.invariants), keeps_strikes(options.strikes), pool(options.threads), rigid(settings) {}

  // Where a body's data is.
  struct Place {
    BodyModel model;
    int index;  // into objects, solids or examples
  };
  struct ActiveForce {
    ApplyForce force;
    double left;  // [s]
  };

  SceneDescription scene;
  bool keeps_invariants;
  bool keeps_strikes;
  ThreadPool pool;
  std::vector<Place> places;  // by BodyId
  std::vector<FemObject> objects;
  std::vector<SoftBody> soft;             // meshes: one an object, then those that broke off, in the order in which they did
  std::vector<SolidBody> solids;
  std::vector<ExampleBody> examples;
  RigidWorld rigid;

  // State besides the bodies'.
  std::uint64_t step = 0;
  std::vector<Command> commands;          // for the next step
  std::vector<ScriptedCommand> script;    // still to come, ascending in time
  std::vector<ActiveForce> forces;
  std::vector<LoadWindow> joint_loads;    // one a joint of the scene
  contact::FrictionMemory friction;
  contact::LastingRows lasting;           // of the last step
  std::vector<guard::BodyGuard> guards;   // one a mesh
  struct IslandAccount {
    std::vector<int> soft;                // meshes that were one island in the last step, and what they have broken into
    double energy = 0;                    // of all of them, before that step [J]
    double work = 0;                      // done on them in it, but for commands and prescribed nodes [J]
    bool capped = false;
    double residual = 0;
  };
  std::vector<IslandAccount> accounts;    // of the last step
  // What sleeps for itself, by one index: a body (of a broken one, its first mesh), by BodyId; then pieces of broken ones, in the
  // order in which they broke off.
  using Part = int;
  std::vector<Piece> broken_off;          // by Part, less the bodies
  std::vector<Part> debris;               // rigid fragments
  std::vector<Part> soft_parts;           // one a mesh
  islands::SleepingIslands sleepers;      // by Part
  std::vector<islands::Stillness> stillness;  // by Part, of live ones

  // Outcome.
  Topology topology;
  std::vector<Event> events;
  std::uint64_t event_count = 0;
  std::vector<StageTime> stage_times;
  example_based::ExampleTimes example_times;
  std::vector<Strike> strikes;
  double (*now_ms)() = nullptr;

  // One step's data, from stage to stage.
  std::vector<contact::CollisionBody> collision_bodies;  // meshes, then solids, then examples, then debris
  std::vector<BodyId> collision_ids;
  std::vector<Part> collision_parts;
  int first_debris = 0, soft_at_detection = 0;           // among them; how many of them are meshes
  std::vector<contact::CollisionPlane> planes;
  std::vector<islands::IslandBody> island_bodies;        // as collision_bodies
  std::vector<islands::CompositeIsland> composite;
  std::vector<islands::IslandOptions> island_options;    // one of each that is solved in one
  std::vector<islands::IslandSolution> solutions;
  std::vector<contact::ContactRow> rows;
  contact::FrictionMemory friction_before;               // of the step before
  contact::LastingRows lasting_before;                   // of the step before
  std::vector<char> was_capped;                          // one a mesh: its last solve ended at its cap
  std::vector<FractureOutcome> broken;                   // one a mesh: in this step so far
  std::vector<char> spent;                               // one a mesh: most of what breaks in this step has
  std::vector<int> breakable;                            // meshes that may break in this step
  std::vector<SoftBody::HandOver> handed_over;           // one of these each: scratch of hand_over(), that quiet steps allocate nothing
  std::vector<SoftBody::Energy> soft_energy;             // one a mesh, after assemble
  std::vector<char> disturbed;                           // by Part: commands or scripts move it in this step
  std::vector<contact::Box3> sleeping_box;               // by Part, of those that are asleep
  std::vector<char> all_fixed;                           // ones: no node of a sleeper is an unknown
  // What stages work in, kept so that steps whose sizes stay what they were allocate nothing.
  contact::DetectionMemory detection;
  contact::RowIndex rows_found;
  islands::SolveMemories solve_memories;
  std::vector<char> touched;                             // by Part: contact has a row of it in this step
  std::vector<char> still;                               // by Part: settle()
  struct {
    std::vector<contact::Box3> live, asleep;
    std::vector<std::size_t> sleeper;
    std::vector<contact::IndexPair> pairs;
    std::vector<char> near;
  } hiding;                                              // hide_far_sleepers()
  struct Work {
    double contact = 0;                                  // [J]
    double rigid_commands = 0;                           // on rigid and example-based bodies [J]
  };
  Work work;                                             // in this step; kept if keeps_invariants

  double time() const { return static_cast<double>(step) * scene.dt; }

  Result<void> make_bodies();
  void prepare();
  void warn_of_floats();
  void make_joints();
  Result<void> check(const Command& command, const std::string& field) const;

  // Stages.
  void apply_commands();
  void prescribe_motion();
  void detect_contact(StepReport& report);
  void assemble();
  void watch();
  void look_at_accounts();
  void solve(StepReport& report);
  void follow_scripts();
  void step_rigid(StepReport& report);
  void break_joints(StepReport& report);
  void deform_examples(StepReport& report);
  void plastic_flow();
  void fracture(StepReport& report);
  void settle(StepReport& report);

  // Islands that sleep (world_sleep.cpp).
  void start_islands();
  Part body_part(BodyId id) const { return static_cast<Part>(id); }
  Part part_of(int body) const { return collision_parts[body]; }  // body: as in collision_bodies
  Part part_of(const SoftBody& mesh) const { return soft_parts[&mesh - soft.data()]; }
  bool is_body(Part part) const { return part < static_cast<Part>(places.size()); }
  const Piece& piece(Part part) const { return broken_off[part - places.size()]; }
  bool is_fragment(Part part) const { return !is_body(part) && piece(part).is_rigid(); }
  RigidFragment& fragment(Part part) { return soft[piece(part).soft].fragments[piece(part).fragment]; }
  const RigidFragment& fragment(Part part) const { return const_cast<Impl*>(this)->fragment(part); }
  bool is_mesh(Part part) const { return is_body(part) ? places[part].model == BodyModel::fem : !is_fragment(part); }
  SoftBody& mesh(Part part) { return soft[is_body(part) ? places[part].index : piece(part).soft]; }  // places: an object's first
  const SoftBody& mesh(Part part) const { return const_cast<Impl*>(this)->mesh(part); }
  int part_count() const { return static_cast<int>(stillness.size()); }
  bool is_live(Part part) const { return sleepers.activity(part) == islands::Activity::live; }
  bool is_live(const SoftBody& body) const { return is_live(part_of(body)); }
  bool is_asleep(Part part) const { return sleepers.activity(part) == islands::Activity::asleep; }
  bool is_asleep(const SoftBody& body) const { return is_asleep(part_of(body)); }
  bool sleeps(BodyId id) const;                     // some part of the body does, and none is live
  std::span<const Vec3> points(Part part) const;    // nodes, or proxy nodes where the body was last placed
  void wake(Part part);
  void roused(std::span<const int> woken);
  void lay_down(Part part, bool carried);
  bool is_felt(double push) const { return push > scene.sleep.wake_acceleration * scene.dt; }
  void feel_commands();
  void feel_scripts();
  void feel_motion(Part mover, const contact::Box3& box);
  void place_for_contact();
  void hide_far_sleepers();
  bool wake_touched();
  void keep_friction_of_sleepers(const contact::FrictionMemory& before);
  void note_contacts();
  bool rests(Part part);
  int steps_of_rest() const;
  Workload workload() const;

  guard::Rung rung(const islands::CompositeIsland& island) const;  // the highest of its bodies'
  islands::IslandOptions solve_options(const islands::CompositeIsland& island) const;
  void set_unknowns(SoftBody& body, islands::IslandBody& unknowns);
  void fill_island_bodies();
  void open_account(const islands::CompositeIsland& island, IslandAccount& account) const;
  void take(const islands::CompositeIsland& island, const islands::IslandSolution& solution, double h, IslandAccount& account,
            StepReport& report);
  void sub_step(const islands::CompositeIsland& island, const contact::FrictionMemory& before, IslandAccount& account,
                StepReport& report);
  // Contact of `bodies` for a step of dt, with what of `going_on` they still have.
  std::vector<contact::ContactRow> find_contact(std::span<const contact::CollisionBody> bodies, double dt,
                                                const contact::LastingRows& going_on) const;
  void remember_lasting(const islands::CompositeIsland& island, double dt, contact::LastingRows& memory) const;
  bool is_pushed(const islands::CompositeIsland& island, int body) const;
  bool break_ahead(const islands::CompositeIsland& island, const islands::IslandSolution& solution, int round);
  // A part of an island that broke, as it was solved in the end.
  struct Solved {
    islands::CompositeIsland island;
    islands::IslandSolution solution;
    std::vector<islands::IslandBody> bodies;
  };
  void solve_broken(const islands::CompositeIsland& island, const contact::FrictionMemory& before, int round,
                    std::vector<Solved>& solved);
  // Nothing: the island does not break. Touches what belongs to the island alone: several may be done at a time.
  std::vector<Solved> solve_breaking(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                                     const contact::FrictionMemory& before);
  // Bodies as contact and solve see them if there were only this island and what does not move.
  struct Alone {
    std::vector<contact::CollisionBody> bodies;
    std::vector<islands::IslandBody> unknowns;
  };
  std::vector<std::vector<Solved>> broken_up;            // of each island: its parts, if it broke in this step
  Alone alone(const islands::CompositeIsland& island) const;
  contact::CollisionBody collision_body(const SoftBody& body) const;

  // Pieces that broke off (world_debris.cpp). `body`: as in collision_bodies.
  bool is_debris(int body) const { return body >= first_debris; }
  RigidFragment& fragment_of(int body) { return fragment(part_of(body)); }
  bool is_of_object(int body, BodyId id) const {  // planes, which follow, are nobody's
    return body < static_cast<int>(collision_ids.size()) && collision_ids[body] == id;
  }
  const SoftBody& parent_of(int body) const { return soft[piece(part_of(body)).soft]; }
  islands::IslandBody debris_for_islands(int body, double h);
  void hand_over();
  void add_part(const Piece& piece);
  void follow_hand_over(int body, const SoftBody::HandOver& moved, int soft_before, int bodies_before);
  double contact_work(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                      std::span<const islands::IslandBody> bodies) const;
  // Of all impulses of contact on all unknowns of an island, at their midpoint velocities [J].
  double work_on_unknowns(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                          std::span<const islands::IslandBody> bodies) const;
  void account_contact(const islands::CompositeIsland& island, const islands::IslandSolution& solution,
                       std::span<const islands::IslandBody> bodies, IslandAccount& account);
  struct RigidTotals {
    double kinetic = 0;            // [J]
    Vec3 momentum = Vec3::Zero();  // [kg m/s]
  };
  RigidTotals rigid_totals() const;  // of all rigid and example-based bodies that move freely

  void apply(const Command& command);
  void push_body(BodyId body, const Vec3& impulse, const Vec3& point, double radius);
  Event& add_event(EventKind kind, BodyId body);
  // In this step, of some piece of the body.
  bool is_said(EventKind kind, BodyId body, const std::string& ending) const;

  // Runs one stage and notes its time if somebody keeps a clock.
  template <class Stage>
  void timed(const char* name, Stage&& stage) {
    const double start = now_ms ? now_ms() : 0;
    stage();
    if (now_ms) stage_times.push_back({name, now_ms() - start});
  }
};

}  // namespace crumple::sim
