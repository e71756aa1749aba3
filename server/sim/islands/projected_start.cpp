#include "server/sim/islands/projected_start.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;

constexpr int kNodesPerChunk = 512;
constexpr int kHolds = 3;
constexpr double kSame = 1e-10;  // of the change's squared norm: what is left of it when it is a multiple of the level

}  // namespace

bool ProjectedStart::applies(const CompositeIsland& island, std::span<const IslandBody> bodies) {
  if (!island.rows.empty() || !island.rigid.empty() || island.soft.size() != 1) return false;
  const IslandBody& body = bodies[island.soft.front()];
  const fem::StepSystem& s = *body.system;
  if (!s.any_prescribed || body.has_start || !body.v_before || static_cast<int>(body.v_before->size()) != s.node_count()) return false;
  held_.assign(s.piece_count, 0);
  for (int i = 0; i < s.node_count(); ++i)
    held_[s.piece[i]] += s.row_mass[i] == 0 ? kHolds : s.prescribed[i];  // a node without a tet is no piece that moves
  return std::ranges::all_of(held_, [](int nodes) { return nodes >= kHolds; });
}

void ProjectedStart::project(const IslandSystem& system, const IslandBody& body, const VectorXd& b, const ThreadPool& pool,
                             VectorXd& x, VectorXd& r) {
  const std::vector<Vec3>& v_before = *body.v_before;
  const int count = static_cast<int>(v_before.size());
  assert(3 * count == x.size());
  for (VectorXd* v : {&level_, &A_level_, &change_, &A_change_}) v->resize(x.size());
  sums_.resize((count + kNodesPerChunk - 1) / kNodesPerChunk);
  const auto sum = [&](int k) {
    double total = 0;
    for (const std::array<double, 3>& chunk : sums_) total += chunk[k];
    return total;
  };

  system.multiply(x, A_level_, pool);
  const auto look_back = [&](int begin, int end) {
    const int first = 3 * begin, n = 3 * (end - begin);
    r.segment(first, n) = b.segment(first, n) - A_level_.segment(first, n);
    for (int i = begin; i < end; ++i) {
      const bool free = !body.system->prescribed[i];  // rows of others are coupled to none
      level_.segment<3>(3 * i) = free ? Vec3(x.segment<3>(3 * i)) : Vec3::Zero();
      change_.segment<3>(3 * i) = free ? Vec3(x.segment<3>(3 * i) - v_before[i]) : Vec3::Zero();
      if (!free) A_level_.segment<3>(3 * i).setZero();
    }
    const auto level = level_.segment(first, n), residual = r.segment(first, n);
    sums_[begin / kNodesPerChunk] = {level.dot(A_level_.segment(first, n)), level.dot(residual),
                                     change_.segment(first, n).dot(residual)};
  };
  pool.for_chunks(count, kNodesPerChunk, std::cref(look_back));
  const double level_level = sum(0), level_r = sum(1), change_r = sum(2);
  if (!(level_level > 0)) return;

  system.multiply(change_, A_change_, pool);
  const auto measure = [&](int begin, int end) {
    const int first = 3 * begin, n = 3 * (end - begin);
    const auto A_change = A_change_.segment(first, n);
    sums_[begin / kNodesPerChunk] = {level_.segment(first, n).dot(A_change), change_.segment(first, n).dot(A_change), 0};
  };
  pool.for_chunks(count, kNodesPerChunk, std::cref(measure));
  const double level_change = sum(0), change_change = sum(1);

  // The normal equations of a v + b (v - v_before), b first.
  const double own = change_change - level_change * level_change / level_level;
  const double of_change = own > kSame * change_change ? (change_r - level_change / level_level * level_r) / own : 0;
  const double of_level = (level_r - level_change * of_change) / level_level;
  if (!std::isfinite(of_level) || !std::isfinite(of_change)) return;
  const auto move = [&](int begin, int end) {
    const int first = 3 * begin, n = 3 * (end - begin);
    x.segment(first, n) += of_level * level_.segment(first, n) + of_change * change_.segment(first, n);
    r.segment(first, n) -= of_level * A_level_.segment(first, n) + of_change * A_change_.segment(first, n);
  };
  pool.for_chunks(count, kNodesPerChunk, std::cref(move));
}

}  // namespace crumple::sim::islands
