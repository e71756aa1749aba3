#pragma once

#include "server/lab/stability/method.h"
#include "server/sim/world.h"

namespace crumple::lab::stability {

struct BlockOptions {
  Vec3 size = Vec3::Ones();              // [m]
  Vec3 centre = Vec3::Zero();            // [m]
  Vec3 velocity = Vec3::Zero();          // [m/s]
  Vec3 angular_velocity = Vec3::Zero();  // [rad/s]
  double turned = 0;                     // about y [rad]
  std::array<int, 3> cells{2, 2, 2};     // of six tets each; not read where blocks are rigid
  double young = 1e6;                    // [Pa]
  double density = 1000;                 // [kg/m^3]
  bool round = false;                    // a disc of diameter size.x and thickness size.y, its axis along y
  double clamp_limit = 0;                // as in sim::FemModel [1/m]
};

// Blocks, plates and a ground in a world, under a contact method of the table. Add bodies, then start().
class ContactTrial {
 public:
  explicit ContactTrial(const ContactMethod& method, double dt = 1.0 / 60);

  BodyId add_block(const BlockOptions& block);             // soft, or rigid where the method says so
  BodyId add_plate(const Vec3& size, const Vec3& centre);  // fixed rigid box
  void add_ground();                                       // y < 0 is solid
  void start();

  sim::StepReport step();
  // Steps; after each one `after_step` may end it by returning false. Ends when something is not sound.
  void run(double seconds, const std::function<bool(const sim::StepReport&)>& after_step = {});

  Vec3 centre(BodyId body) const { return world->pose(body).p_WB; }
  Vec3 velocity(BodyId body) const { return world->velocity(body); }
  double rms_speed(BodyId body) const;  // of its nodes; a rigid box: with its rotation [m/s]
  double lowest(BodyId body) const;     // smallest y [m]
  int inverted() const;                 // over all soft blocks
  double energy() const;                // kinetic, elastic and gravitational [J]
  bool sound() const;                   // finite, nothing frozen, within 10 km

  ContactMethod method;
  sim::SceneDescription scene;
  double friction = 0.5;
  double solver_tolerance = 1e-4;  // rest is judged in mm/s: ten times tighter than the default
  std::unique_ptr<sim::World> world;
  bool frozen = false;
  double worst_penetration = 0;  // of the last run [m]
  int capped = 0;                // solves of the last run
  std::vector<BodyId> blocks, plates;
  bool ground = false;
};

// Pressure proportional to the overlap's depth, 1e6 Pa/m, as forces at the start of the step: the classic penalty
// method. Without friction.
void push_by_penalty(ContactTrial& trial);

// A light block (100 kg) on the ground under one of `ratio` times its density, E = 1e9.
struct HeavyOnLight {
  bool sound = false;
  double penetration = 0;  // deepest overlap in the last third, of the block's thickness [-]
  double speed = 0;        // largest rms speed of a block in the last third [m/s]
  double energy_rise =
      0;  // largest rise of the total energy over one step in the last third, of m g h of the heavy block [-]
  int inverted = 0;
  bool fell = false;  // the heavy block is not above the light one any more
};
HeavyOnLight heavy_on_light(const ContactMethod& method, double ratio, double dt, double seconds);

// A block, or a disc face-on, flies straight at a fixed plate of 4 x 4 m.
struct Shot {
  bool sound = false;
  bool behind = false;     // ends on the far side
  double rebound = 0;      // largest speed away from the plate over the speed of the shot [-]
  double penetration = 0;  // deepest point behind the near face at the end [m]
};
struct ShotOptions {
  Vec3 size = Vec3::Ones();  // [m]
  bool round = false;        // as in BlockOptions
  double speed = 0;          // [m/s]
  double thickness = 0.01;   // of the plate [m]
  double dt = 1.0 / 60;      // [s]
  double phase = 0;          // part of a step's way by which the start is shifted: the plate is met anywhere in a step
  bool sixth_rule = false;   // with the paper's rule for fast bodies, see below
};
// sixth_rule: the paper's section 6, for the raw forms, which otherwise look at steps' ends only. A body that moves
// more than a sixth of its bounding box's diagonal in a step is looked at after sub-steps shorter than that, and put
// where the first of them finds an overlap. Before the plate the flight is free, so that place is known without
// stepping.
Shot shot_at_plate(const ContactMethod& method, const ShotOptions& options);

// A disc of 1 m and 1 cm, E = 1e9 Pa, lies 0.3 m above a fixed plate of 1 cm and spins about a diameter, without
// gravity: its rim sweeps through the plate though its centre does not move.
struct Spun {
  bool sound = false;
  int through = 0;     // ends of a step at which a part of the disc is behind the far face
  double deepest = 0;  // behind the near face, at the end of any step; below 0: how far it stays before it [m]
};
Spun spun_at_plate(const ContactMethod& method, double rate, double dt, double seconds);

}  // namespace crumple::lab::stability
