#include "server/sim/islands/island_system.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <variant>

namespace crumple::sim::islands {

using Eigen::VectorXd;
using linear_solver::SolverKind;

namespace {

// Multigrid pays where there is a piece of so many nodes, so many blocks of unknowns to a piece or rigid body (tiny ones turn
// without its coarse levels seeing it), and so much diagonal of A to mass. Measured over five seeds of each shipped scene: docs/lab.md.
constexpr int kMultigridPiece = 250;
constexpr int kMultigridBlocks = 90;
constexpr double kMultigridStiffness = 200;
constexpr double kModesStiffness = 20;  // rigid modes for their set-up
// Where a body of up to so many nodes is as stiff as that, a factor costs less than any other. It is made when it is needed; of
// larger ones that is a long step, and it is made with the world of those that are held, which is what is left alone for long.
constexpr int kFactorNodes = 300;
constexpr int kHeldFactorNodes = 1000;

constexpr int kRowsPerChunk = 64;  // of a product, some 3 us

// Whether momentum leaves the island through the row.
bool is_anchored(const contact::ContactRow& row) {
  return std::ranges::any_of(row.sides, [](const contact::ContactSide& s) { return !s.rigid && s.node_count < 4; });
}

// The diagonals of matrices over the masses in them [-].
struct Stiffness {
  double diagonal = 0, mass = 0;
  void add(const fem::StepSystem& s) {
    for (int i = 0; i < s.node_count(); ++i) {
      diagonal += s.diagonal()[i].trace();
      mass += 3 * s.row_mass[i];
    }
  }
  double value() const { return diagonal / mass; }
};

bool stays_whole(const IslandBody& body) { return body.factor && !body.rest->breakable(); }

}  // namespace

void IslandSystem::assign(const CompositeIsland& island, std::span<const IslandBody> bodies) {
  island_ = &island;
  bodies_ = bodies;
  first_block_.assign(bodies.size(), -1);
  blocks_ = 0;
  for (const int body : island.soft) {
    first_block_[body] = blocks_;
    blocks_ += bodies[body].system->node_count();
  }
  soft_blocks_ = blocks_;
  for (const int body : island.rigid) {
    first_block_[body] = blocks_;
    blocks_ += 2;
  }
}

void IslandSystem::fill(VectorXd& b, VectorXd& x) const {
  b.resize(3 * blocks_);
  x.resize(3 * blocks_);
  for (const int body : island_->soft) {
    const fem::StepSystem& s = *bodies_[body].system;
    b.segment(3 * first_block_[body], s.b.size()) = s.b;
    x.segment(3 * first_block_[body], s.b.size()) = s.guess;
  }
  for (const int body : island_->rigid) {
    const RigidPart& part = *bodies_[body].rigid;
    b.segment<6>(3 * first_block_[body]) << part.b_v, part.b_w;
    x.segment<6>(3 * first_block_[body]) << part.v, part.w;
  }
}

void IslandSystem::start_from(VectorXd& x) const {
  const auto put = [&](int body) {
    const IslandBody& own = bodies_[body];
    if (own.has_start) x.segment(3 * first_block_[body], own.start.size()) = own.start;
  };
  std::ranges::for_each(island_->soft, put);
  std::ranges::for_each(island_->rigid, put);
}

void IslandSystem::multiply(const VectorXd& x, VectorXd& y, const ThreadPool& pool) const {
  const auto blocks = [&](int begin, int end) { multiply_blocks(begin, end, x, y); };
  pool.for_chunks(blocks_, kRowsPerChunk, std::cref(blocks));
}

void IslandSystem::multiply(const contact::ContactRows& rows, const VectorXd& x, VectorXd& y, const ThreadPool& pool) const {
  if (rows.size() == 0) return multiply(x, y, pool);
  rows.find_forces(x, pool);
  const auto blocks = [&](int begin, int end) {
    multiply_blocks(begin, end, x, y);
    rows.add_forces(begin, end, y);
  };
  pool.for_chunks(blocks_, kRowsPerChunk, std::cref(blocks));
}

double IslandSystem::multiply_and_dot(const contact::ContactRows& rows, const VectorXd& x, VectorXd& y, const ThreadPool& pool) const {
  if (rows.size() > 0) rows.find_forces(x, pool);
  partial_sums_.resize((blocks_ + kRowsPerChunk - 1) / kRowsPerChunk);
  const auto blocks = [&](int begin, int end) {
    multiply_blocks(begin, end, x, y);
    if (rows.size() > 0) rows.add_forces(begin, end, y);
    partial_sums_[begin / kRowsPerChunk] = x.segment(3 * begin, 3 * (end - begin)).dot(y.segment(3 * begin, 3 * (end - begin)));
  };
  pool.for_chunks(blocks_, kRowsPerChunk, std::cref(blocks));
  return std::accumulate(partial_sums_.begin(), partial_sums_.end(), 0.0);
}

// Of all bodies: small ones would not fill the threads one after the other.
void IslandSystem::multiply_blocks(int begin, int end, const VectorXd& x, VectorXd& y) const {
  const auto after = std::ranges::upper_bound(island_->soft, begin, {}, [&](int b) { return first_block_[b]; });
  for (std::size_t k = after - island_->soft.begin(); begin < std::min(end, soft_blocks_); ++k) {
    const int body = island_->soft[k - 1], first = first_block_[body];
    const fem::StepSystem& s = *bodies_[body].system;
    const int stop = std::min(end - first, s.node_count());
    s.multiply_rows(begin - first, stop, x.data() + 3 * first, y.data() + 3 * first);
    begin = first + stop;
  }
  for (; begin < end; ++begin) {
    const RigidPart& part = *bodies_[island_->rigid[(begin - soft_blocks_) / 2]].rigid;
    const Vec3 x_b = x.segment<3>(3 * begin);
    y.segment<3>(3 * begin) = (begin - soft_blocks_) % 2 == 0 ? Vec3(part.mass * x_b) : Vec3(part.inertia_W * x_b);
  }
}

void IslandSystem::diagonal(std::vector<Mat3>& diagonal) const {
  diagonal.clear();
  diagonal.reserve(blocks_);
  for (const int body : island_->soft) {
    const std::vector<Mat3>& own = bodies_[body].system->diagonal();
    diagonal.insert(diagonal.end(), own.begin(), own.end());
  }
  append_rigid_diagonal(diagonal);
}

void IslandSystem::rigid_diagonal(std::vector<Mat3>& diagonal) const {
  diagonal.clear();
  append_rigid_diagonal(diagonal);
}

void IslandSystem::append_rigid_diagonal(std::vector<Mat3>& diagonal) const {
  for (const int body : island_->rigid) {
    diagonal.push_back(bodies_[body].rigid->mass * Mat3::Identity());
    diagonal.push_back(bodies_[body].rigid->inertia_W);
  }
}

void IslandSystem::append_to(std::vector<Eigen::Triplet<double>>& entries) const {
  const auto add = [&](int first_block, const Eigen::SparseMatrix<double>& A) {
    for (int column = 0; column < A.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(A, column); entry; ++entry)
        entries.emplace_back(3 * first_block + entry.row(), 3 * first_block + entry.col(), entry.value());
  };
  for (const int body : island_->soft) add(first_block_[body], bodies_[body].system->to_sparse());
  for (const int body : island_->rigid) {
    add(first_block_[body], (bodies_[body].rigid->mass * Mat3::Identity()).sparseView());
    add(first_block_[body] + 1, bodies_[body].rigid->inertia_W.sparseView());
  }
}

// Where nothing touches a stiff body that is whole and stays so, its factor, if it is small or its factor is there: making one pays over
// hundreds of steps.
// Where a large piece is stiff, multigrid: block-Jacobi needs many iterations there. Where pieces are small, what those
// iterations go into is the motion of pieces as a whole. Soft and light ones are block-Jacobi's.
SolverKind IslandSystem::choose(SolverKind wanted) const {
  if (wanted == SolverKind::jacobi || wanted == SolverKind::direct) return wanted;
  const bool has_factors = !island_->soft.empty() && all_have(&IslandBody::factor);
  if (wanted == SolverKind::multigrid) return all_have(&IslandBody::hierarchy) ? wanted : SolverKind::jacobi;
  if (wanted == SolverKind::rigid_modes) return all_have(&IslandBody::x) ? wanted : SolverKind::jacobi;
  if (wanted == SolverKind::warped_factor && has_factors) return wanted;
  const bool alone = island_->rows.empty() && island_->rigid.empty();
  const auto lasts = [&](int body) {
    return stays_whole(bodies_[body]) && (blocks_ <= kFactorNodes || bodies_[body].factor->has(*bodies_[body].system));
  };
  if (alone && has_factors && std::ranges::all_of(island_->soft, lasts) && stiffness() >= kModesStiffness)
    return SolverKind::warped_factor;
  return choose_without_factors();
}

double IslandSystem::stiffness() const {
  Stiffness stiffness;
  for (const int body : island_->soft) stiffness.add(*bodies_[body].system);
  return stiffness.value();
}

bool is_worth_a_factor(const IslandBody& body) {
  const fem::StepSystem& s = *body.system;
  if (!stays_whole(body) || !s.any_prescribed || s.node_count() > kHeldFactorNodes) return false;
  Stiffness stiffness;
  stiffness.add(s);
  return stiffness.value() >= kModesStiffness;
}

SolverKind IslandSystem::choose_without_factors() const {
  if (island_->soft.empty()) return SolverKind::jacobi;
  int largest = 0;
  double pieces = static_cast<double>(island_->rigid.size());
  for (const int body : island_->soft) {
    const fem::StepSystem& s = *bodies_[body].system;
    pieces += s.piece_count;
    largest = std::max(largest, s.largest_piece);
  }
  const double stiff = stiffness();
  if (all_have(&IslandBody::hierarchy) && largest >= kMultigridPiece && blocks_ >= kMultigridBlocks * pieces && stiff >= kMultigridStiffness)
    return SolverKind::multigrid;
  return all_have(&IslandBody::x) && stiff >= kModesStiffness ? SolverKind::rigid_modes : SolverKind::jacobi;
}

void IslandSystem::update_coarse_levels(std::vector<MultigridPart>& parts, const ThreadPool& pool) const {
  parts.clear();
  for (const int body : island_->soft) {
    const IslandBody& own = bodies_[body];
    std::visit([&](const auto& A) { own.hierarchy->update(A, *own.X, own.system->prescribed, own.mean_tet_volume, pool); },
               own.system->A);
    parts.push_back({own.system, own.hierarchy, first_block_[body]});
  }
}

void IslandSystem::modes_parts(std::vector<ModesPart>& parts) const {
  parts.clear();
  for (const int body : island_->soft) parts.push_back({bodies_[body].system, bodies_[body].x, first_block_[body]});
}

void IslandSystem::update_factors(std::vector<FactorPart>& parts, const ThreadPool& pool) const {
  parts.clear();
  for (const int body : island_->soft) {
    const IslandBody& own = bodies_[body];
    if (!own.factor->update(*own.rest, *own.X, *own.system, pool)) return parts.clear();
    parts.push_back({own.factor, first_block_[body], own.system->node_count()});
  }
}

double IslandSystem::spectral_bound() const {
  double bound = 1;  // of rigid bodies
  for (const int body : island_->soft) bound = std::max(bound, bodies_[body].system->spectral_bound);
  return bound;
}

double IslandSystem::mass() const {
  double mass = 0;
  for (const int body : island_->soft)
    for (const double m : bodies_[body].system->row_mass) mass += m;
  for (const int body : island_->rigid) mass += bodies_[body].rigid->mass;
  return mass;
}

bool IslandSystem::anything_fixed() const {
  if (std::ranges::any_of(island_->soft, [&](int body) { return bodies_[body].system->any_prescribed; })) return true;
  return std::ranges::any_of(island_->rows, [](const contact::ContactRow& row) { return row.active && is_anchored(row); });
}

void IslandSystem::remove_net_momentum_error(VectorXd& x, const VectorXd& b) const {
  Vec3 missing = Vec3::Zero();
  const auto balance = [&](int block, double m) { missing += b.segment<3>(3 * block) - m * x.segment<3>(3 * block); };
  for (const int body : island_->soft) {
    const std::vector<double>& m = bodies_[body].system->row_mass;
    for (int i = 0; i < static_cast<int>(m.size()); ++i) balance(first_block_[body] + i, m[i]);
  }
  for (const int body : island_->rigid) balance(first_block_[body], bodies_[body].rigid->mass);
  const Vec3 dv = missing / mass();
  for (const int body : island_->soft)
    for (int i = 0; i < bodies_[body].system->node_count(); ++i) x.segment<3>(3 * (first_block_[body] + i)) += dv;
  for (const int body : island_->rigid) x.segment<3>(3 * first_block_[body]) += dv;
}

}  // namespace crumple::sim::islands
