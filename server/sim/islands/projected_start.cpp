#include "server/sim/islands/projected_start.h"

#include <cassert>
#include <cmath>

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;

constexpr double kSame = 1e-12;  // of a direction's squared norm: what is left of it when it is a multiple of another

// The entries of prescribed nodes become zero: their rows are coupled to no other.
void leave_out(const std::vector<char>& prescribed, VectorXd& v) {
  for (std::size_t i = 0; i < prescribed.size(); ++i)
    if (prescribed[i]) v.segment<3>(3 * static_cast<Eigen::Index>(i)).setZero();
}

// To the nearest point along d. d_A_d: d . A d.
void move_along(const VectorXd& d, const VectorXd& A_d, double d_A_d, VectorXd& x, VectorXd& r) {
  const double step = d.dot(r) / d_A_d;
  if (!std::isfinite(step)) return;
  x += step * d;
  r -= step * A_d;
}

}  // namespace

bool ProjectedStart::has_history(const CompositeIsland& island, std::span<const IslandBody> bodies) {
  if (!island.rows.empty() || !island.rigid.empty() || island.soft.size() != 1) return false;
  const IslandBody& body = bodies[island.soft.front()];
  return body.system->any_prescribed && !body.has_start && body.v_before && static_cast<int>(body.v_before->size()) == body.system->node_count();
}

void ProjectedStart::project(const IslandSystem& system, const IslandBody& body, const VectorXd& b, const ThreadPool& pool, VectorXd& x,
                             VectorXd& r) {
  assert(static_cast<Eigen::Index>(3 * body.v_before->size()) == x.size());
  const std::vector<char>& prescribed = body.system->prescribed;
  A_level_.resize(x.size());
  A_change_.resize(x.size());
  system.multiply(x, A_level_, pool);
  r = b - A_level_;
  level_ = x;
  change_ = x - Eigen::Map<const VectorXd>(body.v_before->data()->data(), x.size());
  for (VectorXd* v : {&level_, &A_level_, &change_}) leave_out(prescribed, *v);

  const double level = level_.dot(A_level_);
  if (!(level > 0)) return;
  move_along(level_, A_level_, level, x, r);
  system.multiply(change_, A_change_, pool);
  const double all = change_.dot(A_change_), shared = level_.dot(A_change_) / level;
  change_ -= shared * level_;
  A_change_ -= shared * A_level_;
  const double own = change_.dot(A_change_);
  if (own > kSame * all) move_along(change_, A_change_, own, x, r);
}

}  // namespace crumple::sim::islands
