#pragma once

#include "server/sim/contact/contact_rows.h"
#include "server/sim/contact/friction.h"
#include "server/sim/fem/assembly.h"
#include "server/sim/fem/warped_factor.h"
#include "server/sim/linear_solver/conjugate_gradient.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"
#include "server/sim/linear_solver/solver_kind.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

// Bodies in contact form composite islands, each one linear system [Parker & O'Brien 2009, section 4]. Unlike in the
// paper's section 7, a rigid body that touches a soft one is part of the system, as six more unknowns, instead of
// alternating with it (DESIGN decision 5): heavy bodies can rest on soft ones and the other way round.
namespace crumple::sim::islands {

// A movable rigid body. Its equations are m v+ = b_v + contact, I w+ = b_w + contact.
struct RigidPart {
  double mass = 0;                      // [kg]
  Vec3 p_WC = Vec3::Zero();             // centre of mass at the start of the step [m]
  Mat3 inertia_W = Mat3::Identity();    // about the centre of mass, world axes [kg m^2]
  Vec3 v = Vec3::Zero();                // before the step: where the solve starts [m/s]
  Vec3 w = Vec3::Zero();                // [rad/s]
  Vec3 b_v = Vec3::Zero();              // m v + dt f, gravity and all [N s]
  Vec3 b_w = Vec3::Zero();              // I w + dt torque [N m s]
};

// A body by its index in detection: soft (`system`, assembled for this step), movable rigid (`rigid`), or neither.
struct IslandBody {
  const fem::StepSystem* system = nullptr;  // borrowed
  std::optional<RigidPart> rigid;
  bool in_solve = false;                    // a rigid fragment: nobody else steps it
  // Where the solve starts, if not from velocities of before (projected_start.h): 3n of a soft body, (v, w) of a rigid one.
  Eigen::VectorXd start;
  bool has_start = false;
  const std::vector<Vec3>* v_before = nullptr;  // of a soft body: velocities before its last step [m/s], borrowed
  // Of soft bodies, for preconditioners; those that miss something are not used.
  linear_solver::MultigridHierarchy* hierarchy = nullptr;  // borrowed: the body's coarse levels, made when needed
  const std::vector<Vec3>* x = nullptr;                    // positions before the step [m], borrowed
  const std::vector<Vec3>* X = nullptr;                    // rest positions, borrowed
  double mean_tet_volume = 0;                              // [m^3]
  const fem::RestBody* rest = nullptr;                     // borrowed
  fem::WarpedFactor* factor = nullptr;                     // borrowed: of a body that has not broken, made when needed

  void clear();  // as new, but for the memory of `start`
};

struct CompositeIsland {
  std::vector<int> soft, rigid;             // bodies, ascending
  std::vector<contact::ContactRow> rows;    // in the order of detection, then what lasts
};

// Every soft body and rigid fragment is in exactly one island, every other movable rigid body that touches one of them
// too. Fixed bodies and planes join nothing: what only shares the ground solves apart. Islands are ordered by their first soft
// body, after them those without one by their first fragment.
std::vector<CompositeIsland> composite_islands(std::span<const IslandBody> bodies, std::span<const contact::ContactRow> rows);
// The same into `islands`, whose memory is kept.
void composite_islands(std::span<const IslandBody> bodies, std::span<const contact::ContactRow> rows, std::vector<CompositeIsland>& islands);

struct IslandOptions {
  linear_solver::SolveOptions solve;
  int passes = 2;          // >= 1; a further pass is made only if it would differ
  bool may_pull = false;   // the paper's raw damping: rows resist parting, too
  linear_solver::SolverKind solver = linear_solver::SolverKind::automatic;
};

struct RigidVelocity {
  int body;
  Vec3 v, w;  // at the end of the step, other rigid bodies disregarded
};

// An impulse of contact on a movable rigid body, for the rigid room to apply.
struct ContactImpulse {
  int body;
  Vec3 point_W;    // on the body as it was at the start of the step [m]
  Vec3 impulse_W;  // [N s]
  int other;       // body or plane that it comes from, as in detection; the body itself: what the tolerance left
};

struct IslandSolution {
  // Iterations over all passes; residual and convergence of the last one.
  linear_solver::SolveReport report;
  linear_solver::SolverKind solver = linear_solver::SolverKind::jacobi;  // which one it was
  int passes = 0;
  bool finite = true;                    // false: bad input (velocities, forces); `velocity` is that of the start, rigid
                                         // and impulses are empty, no row is active
  Eigen::VectorXd velocity;              // 3 a block: nodes of island.soft in order, then v and w of island.rigid
  std::vector<int> soft_start;           // of each body of island.soft in `velocity`, and one more [scalars]
  std::vector<RigidVelocity> rigid;
  std::vector<ContactImpulse> impulses;  // in the order of rows

  // New velocities of the k-th soft body of the island: 3n, node-major [m/s].
  Eigen::Map<const Eigen::VectorXd> soft_velocity(int k) const {
    return {velocity.data() + soft_start[k], soft_start[k + 1] - soft_start[k]};
  }
};

// Solves one island: conjugate gradients from velocities of before (projected_start.h), contact rows applied matrix-free, block
// diagonal of system and rows as preconditioner. After each pass rows that would pull are dropped and friction is
// bounded; the next pass starts from where it ended. island.rows have their outcome afterwards (lambda_n, lambda_t).
// Where nothing is fixed the net momentum error of the solve is taken out again. memory: of the last step.
IslandSolution solve(CompositeIsland& island, std::span<const IslandBody> bodies, const IslandOptions& options,
                     const contact::FrictionMemory& memory, const ThreadPool& pool);

// What solves work in. Whoever keeps one from step to step lets steps of islands of the same sizes allocate nothing: solve_all has one
// an island.
struct SolveMemory;
struct SolveMemories {
  SolveMemories();
  ~SolveMemories();
  std::vector<std::unique_ptr<SolveMemory>> of_islands;  // in the order in which they are begun
  std::vector<int> blocks, order;                        // one an island
};

// All islands, several at a time [Parker & O'Brien 2009, figure 2]: a free thread takes the largest that is left; those of
// at least 60 blocks and more than a quarter of all are solved by all threads that find none left, others by one.
// options: one per island. The caller remembers the friction of those rows that it keeps. solutions: one an island; their memory
// is kept.
void solve_all(std::span<CompositeIsland> islands, std::span<const IslandBody> bodies, std::span<const IslandOptions> options,
               const contact::FrictionMemory& friction, const ThreadPool& pool, SolveMemories& memories,
               std::vector<IslandSolution>& solutions);

}  // namespace crumple::sim::islands
