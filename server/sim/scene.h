#pragma once

#include "common/types.h"
#include "server/sim/command.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/fem/macro_element.h"
#include "server/sim/fem/material_region.h"
#include "server/sim/linear_solver/solver_kind.h"
#include "server/sim/mesh/splinters.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

// A scene as the core takes it: complete, in memory, SI. scene_convert makes one from scene.proto.
namespace crumple::sim {

// ---- rigid shapes, in the body's axes -------------------------------------------------------------------------
struct Box { Vec3 half_extents = Vec3::Constant(0.5); };                 // [m], each in [1e-4, 1e6]
struct Sphere { double radius = 0.5; };                                  // [m], [1e-4, 1e6]
struct Cylinder { double radius = 0.5; double half_length = 0.5; };      // axis along y [m], both in [1e-4, 1e6]
struct Plane { Vec3 normal = Vec3::UnitY(); double offset = 0; };        // solid where normal . p < offset; fixed only
struct ConvexHull { std::vector<Vec3> points; };                         // 4 to 10,000 points, not coplanar
struct TriangleShape { SurfaceMesh mesh; };                              // fixed bodies: exact; moving ones: GImpact
using Shape = std::variant<Box, Sphere, Cylinder, Plane, ConvexHull, TriangleShape>;

struct PlacedShape {
  Pose pose;  // X_BS of the shape in the body
  Shape shape;
};

// ---- motion that a script prescribes ----------------------------------------------------------------------------
struct PoseKey {
  double time = 0;  // [s], [0, 1e9], ascending
  Pose pose;        // X_WB; linear in p, slerp in R, held before the first and after the last key
};

// Nodes of a finite-element body that follow a script: each key displaces the selected nodes rigidly, about the
// body's origin, from where they are at t = 0. No keys: the nodes are held fixed.
struct NodeMotion {
  std::vector<int> nodes;     // one at least, none twice in a body
  std::vector<PoseKey> keys;  // at most 100,000
};

// ---- models --------------------------------------------------------------------------------------------------------
enum class RigidKind { dynamic, fixed, kinematic };

struct RigidModel {
  RigidKind kind = RigidKind::dynamic;
  std::vector<PlacedShape> shapes;           // 1 to 1,000
  double density = 1000;                     // [kg/m^3], (0, 1e6]
  double mass = 0;                           // [kg], [0, 1e9]; > 0 overrides density
  double friction = 0.5;                     // [-], [0, 10]
  double restitution = 0.1;                  // [-], [0, 1]
  std::vector<PoseKey> motion;               // kinematic bodies only; at most 100,000
  std::shared_ptr<const TetMesh> proxy;      // tets that stand for the body against soft ones, in body axes; null:
                                             // made from the shapes (not possible for TriangleShape)
  std::shared_ptr<const SurfaceMesh> render; // null: drawn from the shapes
};

struct FemModel {
  std::shared_ptr<const TetMesh> mesh;       // rest shape in the body's axes
  fem::FemMaterial material;                 // of the tets that no region has
  std::vector<fem::MaterialRegion> regions;  // at most 1,000
  std::vector<NodeMotion> motions;           // fixed and scripted nodes; at most 1,000
  fem::ElementKind element = fem::ElementKind::linear_tetrahedra;
  double clamp_limit = 0;                    // limit of the basis matrices' singular values [1/m], [0, 1e9];
                                             // 0: 20 / mean edge
  int rigid_fragments = 9;                   // pieces of at most so many tets go on as rigid bodies, [0, 1e6]; 0: none
  bool self_contact = false;                 // parts of one piece that are not near each other at rest meet
  std::shared_ptr<const SurfaceMesh> render; // embedded; null, or breakable: the tets' own surface is drawn
  std::shared_ptr<const SplinterMesh> splinters;  // drawn instead, breakable or not; null: none
};

struct ExampleModel {
  std::shared_ptr<const example_based::ExampleSet> set;
  example_based::ExampleParameters parameters;
  double density = 1000;                     // [kg/m^3], of rest volume times fill, (0, 1e6]
  double mass = 0;                           // [kg], [0, 1e9]; > 0 overrides density
  double friction = 0.5;                     // [-], [0, 10]
};

struct BodyDescription {
  std::string name;                          // unique in the scene, 1 to 256 bytes
  Pose pose;                                 // X_WB at t = 0
  Vec3 velocity = Vec3::Zero();              // [m/s], of the body's origin, |.| <= 1e4
  Vec3 angular_velocity = Vec3::Zero();      // [rad/s], in W, about the body's origin, |.| <= 1e4
  std::variant<RigidModel, FemModel, ExampleModel> model;
  bool asleep = false;                       // from the start, until something wakes it; it then has no velocity, and is
                                             // neither fixed nor kinematic
  std::array<float, 3> colour{0.7f, 0.7f, 0.7f};  // linear RGB in [0, 1]
  float opacity = 1.0f;                      // [0, 1]
};

// Two bodies that are one until the joint gives way [Jones et al. 2016, section 5]. They do not collide until then.
struct JointDescription {
  BodyId a = 0, b = 0;           // rigid or example-based, not both fixed or kinematic
  Vec3 point = Vec3::Zero();     // in W at t = 0 [m]
  double strength = 0;           // force that it bears, as a mean over joint_time [N], [0, inf); 0: any
  double bending = 0;            // moment about the point that it bears, likewise [N m], [0, inf); 0: any
};

// What bounds the friction of a contact.
enum class FrictionLaw {
  coulomb,           // mu times the contact's own normal force; sticks below that
  weight_heuristic,  // the paper's: a damper of the island's weight, shared by volume
};

// ---- contact of soft bodies (Parker & O'Brien 2009, section 6; CONTACT.md's law as default) --------------------
struct ContactSettings {
  bool raw_damping = false;   // the paper's: force phi |r| s and nothing else
  double phi = 1e6;           // [N s / m^3], raw only, [0, 1e15]
  double kappa = 100;         // strength of "law2" rows [-], [0, 1e6]
  double recovery_steps = 4;  // tau = recovery_steps dt: depth is taken back over this time; [1, 1e6]
  double max_recovery_speed = 1;  // v_max [m/s], [0, 1e3]
  FrictionLaw friction = FrictionLaw::coulomb;
};

// ---- islands that sleep (Parker & O'Brien 2009, section 4) ----------------------------------------------------------
// Bodies that touch sleep and wake together: once none of their nodes, for `time`, was faster than `speed` (over two
// steps; in contact twice that, in the mean over 0.1 s) or further from where it was than a fifth of what that speed would take it.
struct SleepSettings {
  double speed = 0.005;             // [m/s], [0, 10]; 0: nothing falls asleep
  double time = 0.5;                // [s], [0, 1e3]; five steps at least
  double wake_acceleration = 0.01;  // what a command must give a node to wake its body, or a body that is not finite
                                    // elements [m/s^2], [0, 1e6]; sleepers do not feel less
};

// How finite-element bodies go on in time.
enum class Integrator {
  backward_euler,  // the paper's, first order: everywhere
  bdf2,            // second order where the motion is smooth; backward Euler where it is not (fem/bdf2.h)
};

struct SceneDescription {
  std::string name;
  Vec3 gravity{0, -9.81, 0};  // [m/s^2], |.| <= 1e4
  double dt = 1.0 / 120;      // [s], [1e-6, 0.2]
  int rigid_substeps = 1;     // Bullet's steps per step, [1, 100]
  int rigid_iterations = 30;  // of Bullet's solver, forth and back, at most, [1, 10'000]
  double creep_dt = 1.0 / 60; // dt_ref of creep [s] (decision 7), [1e-6, 1]
  double rate_dt = 1.0 / 250; // dt_ref of alpha and lambda [s] (decision 7), [1e-6, 1]
  Integrator integrator = Integrator::backward_euler;
  std::optional<bool> float_solver;  // matrix in float; not said: of bodies that are not stiff and ask for no more than 1e-5 (fem/float_matrix.h)
  linear_solver::SolverKind solver = linear_solver::SolverKind::automatic;
  bool unguarded = false;     // for studies: nothing but non-finite states is watched (guard/island_guard.h)
  ContactSettings contact;
  SleepSettings sleep;
  std::uint64_t seed = 1;     // of everything random: fracture order
  std::vector<BodyDescription> bodies;  // at most 10,000; kMaxTets tets in all
  std::vector<JointDescription> joints; // at most 10,000
  int max_breaks_per_step = 32;         // of joints, the most overloaded first, [1, 1e6]
  double joint_time = 1.0 / 60;         // a joint's load is its mean over this time, or a step if longer [s], [0, 1]
  std::vector<ScriptedCommand> script;  // ascending in time; at most 100,000
};

// The one gate for whatever comes from outside: every number finite and within its documented limit, names unique,
// meshes and sets valid, script targets existing and free to move. The first breach is the error; its path is that of
// scene.proto (a pose's p_WB is `pose.position`, its R_WB `pose.quaternion`). The numbers stand in limits.h.
Result<void> validate(const SceneDescription& scene);

}  // namespace crumple::sim
