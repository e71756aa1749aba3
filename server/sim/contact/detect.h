#pragma once

#include "common/types.h"
#include "server/sim/contact/collision_mesh.h"
#include "server/sim/contact/contact_rows.h"
#include "server/sim/contact/self_contact.h"
#include "server/sim/parallel_for.h"
#include "server/sim/scene.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

// Where soft bodies meet others, as rows for the solve [Parker & O'Brien 2009, section 6].
namespace crumple::sim::contact {

struct RigidMotion {
  Vec3 p_WC = Vec3::Zero();  // centre of mass [m]
  Vec3 v = Vec3::Zero();     // of the centre of mass [m/s]; of a kinematic body: in this step
  Vec3 w = Vec3::Zero();     // [rad/s]
  double mass = 0;           // [kg]
  bool movable = true;       // false: fixed or kinematic
  bool in_solve = false;     // a rigid fragment: what else is rigid knows nothing of it, so it meets everything here
};

// A body as contact sees it at the start of a step. Everything is borrowed for the call.
struct CollisionBody {
  const CollisionMesh* mesh = nullptr;    // a rigid body's is its proxy
  std::span<const Vec3> x;                // node positions in W [m]
  std::span<const Vec3> v;                // soft: node velocities [m/s], prescribed nodes with those of this step
  std::span<const char> fixed;            // soft: nonzero for nodes that are not unknowns (prescribed); empty: none
  std::optional<RigidMotion> rigid;       // set: a rigid body, v and fixed are not read
  double friction = 0.5;                  // mu [-]; a pair has the geometric mean of both
  int origin = -1;                        // soft: what it broke off from; those of one are pieces of one body. -1: it has not broken
  std::span<const Vec3> v_before = {};    // soft: before the last step [m/s]; empty: not known
  const SelfContact* self = nullptr;      // soft: of `mesh`, each of whose pieces then also meets itself; null: they do not
};

// Solid where normal . p < offset. Its index in a row is bodies.size() plus its own.
struct CollisionPlane {
  Vec3 normal = Vec3::UnitY();  // unit
  double offset = 0;            // [m]
  double friction = 0.5;
};

struct DetectionInput {
  std::span<const CollisionBody> bodies;
  std::span<const CollisionPlane> planes;
  Vec3 gravity = Vec3::Zero();
  double dt = 0;
  ContactSettings settings;
};

// Rows of: soft body against soft body, rigid body or plane, and of different face-connected components of one soft
// body (tets that share a node never); rigid fragments count as soft bodies. Other rigid bodies do not meet each other here.
// Where a body asks for it, also of parts of one component that are not near each other at rest (self_contact.h).
//
// Default law: detection where the bodies would be at the end of the step without contact, x + dt (v~ + dt g), v~ the velocity of
//   the last two steps (settled_velocity);
//   c_n = kappa m A / V^(2/3), m the reduced mass and V the smaller rest volume of the two components;
//   s* = -gap/dt for what is still apart at the start of the step, min(depth/tau, v_max) for what overlaps there; depth is
//   overlap_depth(V, A), between two soft bodies that are not fast surface_depth(V, A, ...). Rows of the rim of a soft body's surface
//   have less area there (ContactNormal's weight).
//   A pair whose rows have less area than 0.05 V^(2/3) together is as strong as if they had that.
//   Which parts of a component meet where it meets itself is not asked: m and V are those of two halves, a quarter of its
//   mass and half its volume. Rows of rigid fragments have 0.3 kappa and 2 tau. Against a plane each node below it has a row
//   of its own (submerged_nodes.h).
// Components that would pass wholly through each other in the step, whatever of them meets at its ends, have instead rows of the
// nodes and edges that would: they stop where the first of them meet (detect_swept.cpp). Not swept are rigid fragments, and pieces
// of one body against each other and themselves.
// Raw law, the paper's: detection at x; c_n = dt phi |r|, s* = 0: damping, in both directions, and nothing else.
// Friction by settings.friction: Coulomb's, a bound that the passes of a solve keep (friction.h), or by weight
// (weight_friction.h).
// Rows are in ascending order of their components and tets, then those of pieces that meet themselves by patch, planes
// last; the order and the bits do not depend on the number of threads. Bodies of non-finite position meet nothing.
std::vector<ContactRow> detect(const DetectionInput& input, const ThreadPool& pool);

// What detection works in. Whoever keeps one from step to step lets it allocate nothing, but to grow; one call at a time.
class DetectionMemory {
 public:
  DetectionMemory();
  ~DetectionMemory();

 private:
  friend void detect(const DetectionInput&, const ThreadPool&, DetectionMemory&, std::vector<ContactRow>&);
  struct Vectors;
  std::unique_ptr<Vectors> vectors_;
};
void detect(const DetectionInput& input, const ThreadPool& pool, DetectionMemory& memory, std::vector<ContactRow>& rows);  // replaces `rows`

// Deepest overlap at the start of the step [m], 0 if there is none.
double deepest(std::span<const ContactRow> rows);

}  // namespace crumple::sim::contact
