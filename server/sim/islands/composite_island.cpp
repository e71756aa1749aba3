#include "server/sim/islands/composite_island.h"

#include "server/sim/contact/weight_friction.h"
#include "server/sim/finite.h"
#include "server/sim/islands/island_preconditioner.h"
#include "server/sim/islands/island_system.h"
#include "server/sim/islands/projected_start.h"
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

constexpr int kRowsPerChunk = 64;

bool has_unknowns(const ContactSide& side) { return side.node_count > 0 || side.rigid; }

// Parker & O'Brien 2009, section 4: what more than one thread is to work on; here in blocks of unknowns, of which a node is one.
bool is_large(int blocks, int all) { return blocks >= 60 && 4 * blocks > all; }

int block_count(const CompositeIsland& island, std::span<const IslandBody> bodies) {
  int blocks = 2 * static_cast<int>(island.rigid.size());
  for (const int body : island.soft) blocks += bodies[body].system->node_count();
  return blocks;
}

// The whole system by one factor. residual: |b - A x| / |b| as it is.
linear_solver::SolveReport solve_directly(const IslandSystem& system, const ContactRows& rows, const VectorXd& b,
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

// One solve with the rows as they stand. has_residual: as SolveOptions has it.
linear_solver::SolveReport solve_pass(const IslandSystem& system, const ContactRows& rows, const VectorXd& b_without_rows,
                                      const IslandOptions& options, IslandPreconditioner& preconditioner,
                                      bool has_residual, linear_solver::CgWorkspace& workspace, VectorXd& b, VectorXd& x,
                                      const ThreadPool& pool) {
  b = b_without_rows;
  rows.add_to_rhs(b, pool);
  const auto apply = [&](const VectorXd& in, VectorXd& out) { system.multiply(rows, in, out, pool); };
  if (options.solver == SolverKind::direct) return solve_directly(system, rows, b, std::cref(apply), x);
  preconditioner.refresh(rows);
  const auto precondition = [&](const VectorXd& in, VectorXd& out) { preconditioner.apply(in, out); };
  const auto apply_and_dot = [&](const VectorXd& in, VectorXd& out) { return system.multiply_and_dot(rows, in, out, pool); };
  linear_solver::SolveOptions solve = options.solve;
  solve.near_inverse = preconditioner.near_inverse();
  solve.has_residual = has_residual;
  return linear_solver::conjugate_gradient(std::cref(apply), std::cref(precondition), b, x, solve, workspace, pool, preconditioner.norm(),
                                           preconditioner.blocks(), std::cref(apply_and_dot));
}

// What the rows did to rigid bodies, and what the solve's velocities say besides, at the centre of mass: no momentum is
// lost to the tolerance.
void gather_rigid_outcome(const CompositeIsland& island, std::span<const IslandBody> bodies, std::span<const int> first_block,
                          std::vector<Vec3>& missing, IslandSolution& solution) {
  for (const int body : island.rigid) {
    const int begin = 3 * first_block[body];
    solution.rigid.push_back({body, solution.velocity.segment<3>(begin), solution.velocity.segment<3>(begin + 3)});
  }
  missing.clear();
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

void IslandBody::clear() {
  VectorXd kept = std::move(start);
  *this = {};
  start = std::move(kept);
}

std::vector<CompositeIsland> composite_islands(std::span<const IslandBody> bodies, std::span<const ContactRow> rows) {
  std::vector<CompositeIsland> islands;
  composite_islands(bodies, rows, islands);
  return islands;
}

void composite_islands(std::span<const IslandBody> bodies, std::span<const ContactRow> rows, std::vector<CompositeIsland>& islands) {
  const int count = static_cast<int>(bodies.size());
  thread_local std::vector<int> parent, island_of_root;
  parent.resize(count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const ContactRow& row : rows) {
    if (!has_unknowns(row.sides[0]) || !has_unknowns(row.sides[1])) continue;
    unite(parent, row.sides[0].body, row.sides[1].body);
  }

  std::size_t used = 0;
  island_of_root.assign(count, -1);
  const auto island_of = [&](int body) -> CompositeIsland& { return islands[island_of_root[find_root(parent, body)]]; };
  const auto open = [&](int body) {
    int& island = island_of_root[find_root(parent, body)];
    if (island >= 0) return;
    island = static_cast<int>(used++);
    if (islands.size() < used) islands.emplace_back();
    CompositeIsland& opened = islands[island];
    opened.soft.clear();
    opened.rigid.clear();
    opened.rows.clear();
  };
  for (int body = 0; body < count; ++body)
    if (bodies[body].system != nullptr) open(body), island_of(body).soft.push_back(body);
  for (int body = 0; body < count; ++body)
    if (bodies[body].in_solve) open(body);
  // Others that have a row: what broke away from them in this step may have left them with a sleeper alone.
  for (const ContactRow& row : rows)
    for (const ContactSide& side : row.sides)
      if (has_unknowns(side)) open(side.body);
  for (int body = 0; body < count; ++body)
    if (bodies[body].rigid && island_of_root[find_root(parent, body)] >= 0) island_of(body).rigid.push_back(body);
  for (const ContactRow& row : rows) {
    const int side = has_unknowns(row.sides[0]) ? 0 : 1;
    if (has_unknowns(row.sides[side])) island_of(row.sides[side].body).rows.push_back(row);
  }
  islands.resize(used);
}

struct SolveMemory {
  IslandSystem system;
  ContactRows rows;
  IslandPreconditioner preconditioner;
  ProjectedStart projected;
  linear_solver::CgWorkspace workspace;
  VectorXd b, b_with_rows, start;
  std::vector<Vec3> u_start, u, missing;
};

SolveMemories::SolveMemories() = default;
SolveMemories::~SolveMemories() = default;

namespace {

void solve_in(SolveMemory& m, CompositeIsland& island, std::span<const IslandBody> bodies, const IslandOptions& options,
              const contact::FrictionMemory& friction, const ThreadPool& pool, IslandSolution& solution) {
  assert(options.passes >= 1);
  m.system.assign(island, bodies);
  const IslandSystem& system = m.system;
  m.rows.assign(island.rows, system.first_block(), system.blocks());
  ContactRows& rows = m.rows;
  solution.report = {};
  solution.passes = 0;
  solution.soft_start.clear();
  solution.rigid.clear();
  solution.impulses.clear();
  VectorXd& x = solution.velocity;
  system.fill(m.b, x);
  for (const int body : island.soft) solution.soft_start.push_back(3 * system.first_block()[body]);
  solution.soft_start.push_back(3 * (system.blocks() - 2 * static_cast<int>(island.rigid.size())));

  m.workspace.resize(x.size());
  m.start = x;
  m.u_start.resize(rows.size());
  const auto for_rows = [&](const auto& see) {
    const auto some = [&](int begin, int end) {
      for (int k = begin; k < end; ++k) see(k);
    };
    pool.for_chunks(rows.size(), kRowsPerChunk, std::cref(some));
  };
  for_rows([&](int k) {
    m.u_start[k] = rows.relative_velocity(k, m.start);
    contact::start_row(friction, m.u_start[k], options.may_pull, island.rows[k]);
  });
  system.start_from(x);
  m.u.resize(rows.size());
  m.preconditioner.assign(system, options.solver, pool);
  solution.solver = m.preconditioner.kind();
  const bool projected = options.solver != SolverKind::direct && m.projected.applies(island, bodies);  // then no row: one pass
  if (projected) m.projected.project(system, bodies[island.soft.front()], m.b, pool, x, m.workspace.r);
  const bool by_weight = std::ranges::any_of(island.rows, [](const ContactRow& row) { return row.weight_speed > 0; });
  const double mass = by_weight ? system.mass() : 0;
  for (bool differs = true; differs && solution.passes < options.passes;) {
    ++solution.passes;
    if (by_weight) contact::set_weight_friction(mass, m.u_start, island.rows);
    rows.refresh(pool);
    const linear_solver::SolveReport report =
        solve_pass(system, rows, m.b, options, m.preconditioner, projected, m.workspace, m.b_with_rows, x, pool);
    solution.report = {solution.report.iterations + report.iterations, report.residual, report.converged};
    if (solution.passes == options.passes) break;
    for_rows([&](int k) { m.u[k] = rows.relative_velocity(k, x); });
    differs = contact::refresh_rows(island.rows, m.u, options.may_pull);
  }
  solution.finite = all_finite(m.b) && all_finite(x);
  if (!solution.finite) {  // nothing of it may reach a rigid body or the next step
    x = m.start;
    for (ContactRow& row : island.rows) row.active = false;
    return;
  }

  for_rows([&](int k) { contact::set_outcome(island.rows[k], rows.relative_velocity(k, x)); });
  if (!system.anything_fixed()) system.remove_net_momentum_error(x, m.b);
  gather_rigid_outcome(island, bodies, system.first_block(), m.missing, solution);
}

}  // namespace

IslandSolution solve(CompositeIsland& island, std::span<const IslandBody> bodies, const IslandOptions& options,
                     const contact::FrictionMemory& memory, const ThreadPool& pool) {
  SolveMemory working;
  IslandSolution solution;
  solve_in(working, island, bodies, options, memory, pool, solution);
  return solution;
}

void solve_all(std::span<CompositeIsland> islands, std::span<const IslandBody> bodies, std::span<const IslandOptions> options,
               const contact::FrictionMemory& friction, const ThreadPool& pool, SolveMemories& memories,
               std::vector<IslandSolution>& solutions) {
  assert(options.size() == islands.size());
  std::vector<int>& blocks = memories.blocks;
  std::vector<int>& order = memories.order;
  blocks.clear();
  for (const CompositeIsland& island : islands) blocks.push_back(block_count(island, bodies));
  order.resize(islands.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](int a, int b) { return blocks[a] != blocks[b] ? blocks[a] > blocks[b] : a < b; });
  const int all = std::accumulate(blocks.begin(), blocks.end(), 0);
  const ThreadPool alone(1);
  solutions.resize(islands.size());
  while (memories.of_islands.size() < islands.size()) memories.of_islands.push_back(std::make_unique<SolveMemory>());
  const auto job = [&](int i) {
    const int k = order[i];
    solve_in(*memories.of_islands[i], islands[k], bodies, options[k], friction, is_large(blocks[k], all) ? pool : alone, solutions[k]);
  };
  pool.for_jobs(static_cast<int>(islands.size()), std::cref(job));
}

}  // namespace crumple::sim::islands
