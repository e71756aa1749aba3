#include "server/sim/islands/composite_island.h"

#include "server/sim/contact/weight_friction.h"
#include "server/sim/islands/composite_multigrid.h"
#include "server/sim/linear_solver/block_jacobi.h"
#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/mesh/disjoint_sets.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace crumple::sim::islands {
namespace {

using contact::ContactRow;
using contact::ContactRows;
using contact::ContactSide;
using Eigen::VectorXd;
using linear_solver::SolverKind;

constexpr int kMultigridBlocks = 60;        // blocks of unknowns to a piece or rigid body, and
constexpr double kMultigridStiffness = 20;  // diagonal of A to mass, from which on a cycle pays for its set-up

bool has_unknowns(const ContactSide& side) { return side.node_count > 0 || side.rigid; }

// Whether momentum leaves the island through the row.
bool is_anchored(const ContactRow& row) {
  return std::ranges::any_of(row.sides, [](const ContactSide& s) { return !s.rigid && s.node_count < 4; });
}

// The island's matrix without contact, its right-hand side and its layout.
class System {
 public:
  System(const CompositeIsland& island, std::span<const IslandBody> bodies) : island_(island), bodies_(bodies) {
    first_block_.assign(bodies.size(), -1);
    for (const int body : island.soft) {
      first_block_[body] = blocks_;
      blocks_ += bodies[body].system->node_count();
    }
    for (const int body : island.rigid) {
      first_block_[body] = blocks_;
      blocks_ += 2;
    }
  }

  int blocks() const { return blocks_; }
  std::span<const int> first_block() const { return first_block_; }

  void fill(VectorXd& b, VectorXd& x) const {
    b.resize(3 * blocks_);
    x.resize(3 * blocks_);
    for (const int body : island_.soft) {
      const fem::StepSystem& s = *bodies_[body].system;
      b.segment(3 * first_block_[body], s.b.size()) = s.b;
      x.segment(3 * first_block_[body], s.b.size()) = s.guess;
    }
    for (const int body : island_.rigid) {
      const RigidPart& part = *bodies_[body].rigid;
      b.segment<6>(3 * first_block_[body]) << part.b_v, part.b_w;
      x.segment<6>(3 * first_block_[body]) << part.v, part.w;
    }
  }

  // Bodies that know better than their velocities before the step where to start.
  void start_from(VectorXd& x) const {
    const auto put = [&](int body) {
      if (const auto& start = bodies_[body].start) x.segment(3 * first_block_[body], start->size()) = *start;
    };
    std::ranges::for_each(island_.soft, put);
    std::ranges::for_each(island_.rigid, put);
  }

  void multiply(const VectorXd& x, VectorXd& y, const ThreadPool& pool) const {
    for (const int body : island_.soft) {
      const fem::StepSystem& s = *bodies_[body].system;
      const int begin = 3 * first_block_[body], size = 3 * s.node_count();
      s.multiply(x.segment(begin, size), y.segment(begin, size), pool);
    }
    for (const int body : island_.rigid) {
      const RigidPart& part = *bodies_[body].rigid;
      const int begin = 3 * first_block_[body];
      y.segment<3>(begin) = part.mass * x.segment<3>(begin);
      y.segment<3>(begin + 3) = part.inertia_W * x.segment<3>(begin + 3);
    }
  }

  void fill_diagonal(std::vector<Mat3>& diagonal) const {
    diagonal.clear();
    for (const int body : island_.soft) {
      const std::vector<Mat3>& own = bodies_[body].system->diagonal();
      diagonal.insert(diagonal.end(), own.begin(), own.end());
    }
    const std::vector<Mat3> rigid = rigid_diagonal();
    diagonal.insert(diagonal.end(), rigid.begin(), rigid.end());
  }

  // What a multigrid cycle works on; brings the bodies' coarse levels up to date.
  std::vector<MultigridPart> update_coarse_levels(const ThreadPool& pool) const {
    std::vector<MultigridPart> parts;
    for (const int body : island_.soft) {
      const IslandBody& own = bodies_[body];
      std::visit([&](const auto& A) { own.hierarchy->update(A, *own.X, own.system->prescribed, own.mean_tet_volume, pool); },
                 own.system->A);
      parts.push_back({own.system, own.hierarchy, first_block_[body]});
    }
    return parts;
  }

  std::vector<Mat3> rigid_diagonal() const {
    std::vector<Mat3> diagonal;
    for (const int body : island_.rigid) {
      diagonal.push_back(bodies_[body].rigid->mass * Mat3::Identity());
      diagonal.push_back(bodies_[body].rigid->inertia_W);
    }
    return diagonal;
  }

  void append_to(std::vector<Eigen::Triplet<double>>& entries) const {
    const auto add = [&](int first_block, const Eigen::SparseMatrix<double>& A) {
      for (int column = 0; column < A.outerSize(); ++column)
        for (Eigen::SparseMatrix<double>::InnerIterator entry(A, column); entry; ++entry)
          entries.emplace_back(3 * first_block + entry.row(), 3 * first_block + entry.col(), entry.value());
    };
    for (const int body : island_.soft) add(first_block_[body], bodies_[body].system->to_sparse());
    for (const int body : island_.rigid) {
      add(first_block_[body], (bodies_[body].rigid->mass * Mat3::Identity()).sparseView());
      add(first_block_[body] + 1, bodies_[body].rigid->inertia_W.sparseView());
    }
  }

  // Multigrid where block-Jacobi needs many iterations: in large connected pieces whose stiffness outweighs their mass.
  bool use_multigrid(SolverKind wanted) const {
    if (wanted == SolverKind::jacobi || wanted == SolverKind::direct) return false;
    if (std::ranges::any_of(island_.soft, [&](int body) { return bodies_[body].hierarchy == nullptr; })) return false;
    if (wanted == SolverKind::multigrid) return true;
    double pieces = static_cast<double>(island_.rigid.size()), diagonal = 0, mass = 0;
    for (const int body : island_.soft) {
      pieces += bodies_[body].pieces;
      const fem::StepSystem& s = *bodies_[body].system;
      for (int i = 0; i < s.node_count(); ++i) {
        diagonal += s.diagonal()[i].trace();
        mass += 3 * s.row_mass[i];
      }
    }
    return blocks_ >= kMultigridBlocks * pieces && diagonal >= kMultigridStiffness * mass;
  }

  bool anything_fixed() const {
    if (std::ranges::any_of(island_.soft, [&](int body) { return bodies_[body].system->any_prescribed; })) return true;
    return std::ranges::any_of(island_.rows, [](const ContactRow& row) { return row.active && is_anchored(row); });
  }

  double mass() const {
    double mass = 0;
    for (const int body : island_.soft)
      for (const double m : bodies_[body].system->row_mass) mass += m;
    for (const int body : island_.rigid) mass += bodies_[body].rigid->mass;
    return mass;
  }

  // Adds the one velocity that makes the sum of all equations of motion hold. Elastic and contact terms of a free island
  // sum to zero, and see nothing of a common velocity: the rows' impulses stay what they are.
  void remove_net_momentum_error(VectorXd& x, const VectorXd& b) const {
    Vec3 missing = Vec3::Zero();
    double mass = 0;
    const auto balance = [&](int block, double m) {
      missing += b.segment<3>(3 * block) - m * x.segment<3>(3 * block);
      mass += m;
    };
    for (const int body : island_.soft) {
      const std::vector<double>& m = bodies_[body].system->row_mass;
      for (int i = 0; i < static_cast<int>(m.size()); ++i) balance(first_block_[body] + i, m[i]);
    }
    for (const int body : island_.rigid) balance(first_block_[body], bodies_[body].rigid->mass);
    const Vec3 dv = missing / mass;
    for (const int body : island_.soft)
      for (int i = 0; i < bodies_[body].system->node_count(); ++i) x.segment<3>(3 * (first_block_[body] + i)) += dv;
    for (const int body : island_.rigid) x.segment<3>(3 * first_block_[body]) += dv;
  }

 private:
  const CompositeIsland& island_;
  std::span<const IslandBody> bodies_;
  std::vector<int> first_block_;  // by body, -1 outside the island
  int blocks_ = 0;
};

// The whole system by one factor. residual: |b - A x| / |b| as it is.
linear_solver::SolveReport solve_directly(const System& system, const ContactRows& rows, const VectorXd& b,
                                          const linear_solver::LinearMap& apply, VectorXd& x) {
  std::vector<Eigen::Triplet<double>> entries;
  system.append_to(entries);
  rows.append_to(entries);
  Eigen::SparseMatrix<double> A(b.size(), b.size());
  A.setFromTriplets(entries.begin(), entries.end());
  linear_solver::Cholesky factor;
  const double size = b.norm();
  if (!std::isfinite(size) || !factor.factor(A)) return {1, std::numeric_limits<double>::quiet_NaN(), false};
  x = factor.solve(b);
  VectorXd Ax(b.size());
  apply(x, Ax);
  const double residual = size > 0 ? (b - Ax).norm() / size : 0;
  return {1, residual, std::isfinite(residual)};
}

// One solve with the rows as they stand.
linear_solver::SolveReport solve_pass(const System& system, const ContactRows& rows, const VectorXd& b_without_rows,
                                      const IslandOptions& options, std::span<const MultigridPart> parts,
                                      linear_solver::CgWorkspace& workspace, VectorXd& x, const ThreadPool& pool) {
  VectorXd b = b_without_rows;
  rows.add_to_rhs(b);
  const auto apply = [&](const VectorXd& in, VectorXd& out) {
    system.multiply(in, out, pool);
    rows.apply_add(in, out, pool);
  };
  if (options.solver == SolverKind::direct) return solve_directly(system, rows, b, std::cref(apply), x);
  if (!parts.empty()) {
    CompositeMultigrid multigrid(parts, system.rigid_diagonal(), rows, pool);
    const auto precondition = [&](const VectorXd& in, VectorXd& out) { multigrid.apply(in, out); };
    return linear_solver::conjugate_gradient(std::cref(apply), std::cref(precondition), b, x, options.solve, workspace, pool);
  }
  std::vector<Mat3> diagonal;
  system.fill_diagonal(diagonal);
  rows.add_to_diagonal(diagonal);
  linear_solver::BlockJacobi jacobi;
  jacobi.assign(diagonal);
  jacobi.invert(pool);
  const auto precondition = [&](const VectorXd& in, VectorXd& out) { jacobi.apply(in, out, pool); };
  return linear_solver::conjugate_gradient(std::cref(apply), std::cref(precondition), b, x, options.solve, workspace, pool);
}

// What the rows did to rigid bodies, and what the solve's velocities say besides, at the centre of mass: no momentum is
// lost to the tolerance.
void gather_rigid_outcome(const CompositeIsland& island, std::span<const IslandBody> bodies,
                          std::span<const int> first_block, IslandSolution& solution) {
  for (const int body : island.rigid) {
    const int begin = 3 * first_block[body];
    solution.rigid.push_back({body, solution.velocity.segment<3>(begin), solution.velocity.segment<3>(begin + 3)});
  }
  std::vector<Vec3> missing;
  for (const RigidVelocity& after : solution.rigid) {
    missing.push_back(bodies[after.body].rigid->mass * after.v - bodies[after.body].rigid->b_v);
  }
  const auto push = [&](const ContactRow& row, int side, const Vec3& impulse) {
    const ContactSide& own = row.sides[side];
    if (!own.rigid || !row.active) return;
    solution.impulses.push_back({own.body, bodies[own.body].rigid->p_WC + own.arm, impulse, row.sides[1 - side].body});
    missing[std::ranges::lower_bound(island.rigid, own.body) - island.rigid.begin()] -= impulse;
  };
  for (const ContactRow& row : island.rows) {
    push(row, 0, row.impulse());
    push(row, 1, -row.impulse());
  }
  for (std::size_t k = 0; k < island.rigid.size(); ++k) {
    solution.impulses.push_back({island.rigid[k], bodies[island.rigid[k]].rigid->p_WC, missing[k], island.rigid[k]});
  }
}

}  // namespace

std::vector<CompositeIsland> composite_islands(std::span<const IslandBody> bodies, std::vector<ContactRow> rows) {
  const int count = static_cast<int>(bodies.size());
  std::vector<int> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const ContactRow& row : rows) {
    if (!has_unknowns(row.sides[0]) || !has_unknowns(row.sides[1])) continue;
    unite(parent, row.sides[0].body, row.sides[1].body);
  }

  std::vector<CompositeIsland> islands;
  std::vector<int> island_of_root(count, -1);
  const auto island_of = [&](int body) -> CompositeIsland& { return islands[island_of_root[find_root(parent, body)]]; };
  const auto open = [&](int body) {
    int& island = island_of_root[find_root(parent, body)];
    if (island >= 0) return;
    island = static_cast<int>(islands.size());
    islands.emplace_back();
  };
  for (int body = 0; body < count; ++body)
    if (bodies[body].system != nullptr) open(body), island_of(body).soft.push_back(body);
  for (int body = 0; body < count; ++body)
    if (bodies[body].in_solve) open(body);
  // A row has a side that is soft or a fragment, so another rigid body is in an island exactly if a row touches it.
  for (int body = 0; body < count; ++body)
    if (bodies[body].rigid && island_of_root[find_root(parent, body)] >= 0) island_of(body).rigid.push_back(body);
  for (ContactRow& row : rows) {
    const int side = has_unknowns(row.sides[0]) ? 0 : 1;
    if (has_unknowns(row.sides[side])) island_of(row.sides[side].body).rows.push_back(row);
  }
  return islands;
}

IslandSolution solve(CompositeIsland& island, std::span<const IslandBody> bodies, const IslandOptions& options,
                     const contact::FrictionMemory& memory, const ThreadPool& pool) {
  assert(options.passes >= 1);
  const System system(island, bodies);
  ContactRows rows(island.rows, system.first_block(), system.blocks());
  IslandSolution solution;
  VectorXd& x = solution.velocity;
  VectorXd b;
  system.fill(b, x);
  for (const int body : island.soft) solution.soft_start.push_back(3 * system.first_block()[body]);
  solution.soft_start.push_back(3 * (system.blocks() - 2 * static_cast<int>(island.rigid.size())));

  linear_solver::CgWorkspace workspace;
  workspace.resize(x.size());
  const VectorXd start = x;
  std::vector<Vec3> u(rows.size()), u_start(rows.size());
  for (int k = 0; k < rows.size(); ++k) {
    u_start[k] = rows.relative_velocity(k, start);
    contact::start_row(memory, u_start[k], options.may_pull, island.rows[k]);
  }
  system.start_from(x);
  const std::vector<MultigridPart> parts =
      system.use_multigrid(options.solver) ? system.update_coarse_levels(pool) : std::vector<MultigridPart>{};
  for (bool differs = true; differs && solution.passes < options.passes;) {
    ++solution.passes;
    contact::set_weight_friction(system.mass(), u_start, island.rows);
    rows.refresh();
    const linear_solver::SolveReport report = solve_pass(system, rows, b, options, parts, workspace, x, pool);
    solution.report = {solution.report.iterations + report.iterations, report.residual, report.converged};
    if (solution.passes == options.passes) break;
    for (int k = 0; k < rows.size(); ++k) u[k] = rows.relative_velocity(k, x);
    differs = contact::refresh_rows(island.rows, u, options.may_pull);
  }
  solution.finite = b.allFinite() && x.allFinite();
  if (!solution.finite) {  // nothing of it may reach a rigid body or the next step
    x = start;
    for (ContactRow& row : island.rows) row.active = false;
    return solution;
  }

  for (int k = 0; k < rows.size(); ++k) contact::set_outcome(island.rows[k], rows.relative_velocity(k, x));
  if (!system.anything_fixed()) system.remove_net_momentum_error(x, b);
  gather_rigid_outcome(island, bodies, system.first_block(), solution);
  return solution;
}

std::vector<IslandSolution> solve_all(std::span<CompositeIsland> islands, std::span<const IslandBody> bodies,
                                      std::span<const IslandOptions> options, const contact::FrictionMemory& memory,
                                      const ThreadPool& pool) {
  assert(options.size() == islands.size());
  std::vector<IslandSolution> solutions(islands.size());
  pool.for_chunks(static_cast<int>(islands.size()), 1, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) solutions[k] = solve(islands[k], bodies, options[k], memory, pool);
  });
  return solutions;
}

}  // namespace crumple::sim::islands
