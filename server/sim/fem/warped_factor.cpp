#include "server/sim/fem/warped_factor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>

namespace crumple::sim::fem {

using Eigen::VectorXd;

namespace {

constexpr int kTetsPerChunk = 512;
constexpr int kNodesPerChunk = 512;

// The system's matrix with every node at rest: the same masses, factors and struck rows.
Eigen::SparseMatrix<double> matrix_at_rest(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system,
                                           const ThreadPool& pool) {
  const int n = system.node_count();
  const FemState at_rest{X, std::vector<Vec3>(n, Vec3::Zero()), std::vector<Mat3>(rest.point_count(), Mat3::Zero())};
  std::vector<PrescribedNode> prescribed;
  for (int i = 0; i < n; ++i)
    if (system.prescribed[i]) prescribed.push_back({i, Vec3::Zero()});
  const StepFormula formula{.dt = system.scale.dt, .mass = system.scale.mass, .position = system.scale.position, .w = at_rest.v,
                            .x_known = X, .x_linear = X};
  StepSystem own;
  assemble(rest, system.tets, at_rest, formula, VectorXd::Zero(3 * n), prescribed, pool, own);
  Eigen::SparseMatrix<double> A = own.to_sparse();
  A.prune([](int, int, double value) { return value != 0; });  // what was struck
  return A;
}

// Of tet t; of groups the mean of its two.
Quat rotation_of(const RestBody& rest, const StepSystem& system, int t) {
  if (!rest.grouped()) return Quat(system.elements.Q[t]);
  const std::vector<Mat3>& Q = system.elements.macros.Q;
  const Quat a(Q[rest.macros.of_tet[2 * t]]), b(Q[rest.macros.of_tet[2 * t + 1]]);
  Quat mean;
  mean.coeffs() = a.coeffs() + (a.dot(b) < 0 ? -b.coeffs() : b.coeffs());
  return mean.normalized();
}

}  // namespace

bool WarpedFactor::update(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system, const ThreadPool& pool) {
  assert(static_cast<int>(X.size()) == system.node_count());
  if (tets_ != system.tets) {
    tets_ = system.tets;
    stars_ = NodeStars(tets_, system.node_count());
    kept_.clear();
  }
  const auto known = std::ranges::find_if(kept_, [&](const Kept& k) {
    return k.scale == system.scale && k.prescribed == system.prescribed;
  });
  if (known != kept_.end()) {
    std::rotate(known, known + 1, kept_.end());
  } else {
    if (kept_.size() == kMostKept) kept_.erase(kept_.begin());
    Kept& made = kept_.emplace_back(Kept{system.scale, system.prescribed, false, {}});
    linear_solver::Cholesky cholesky;
    made.usable = cholesky.factor(matrix_at_rest(rest, X, system, pool));
    if (made.usable) made.solve = linear_solver::SupernodalSolve(cholesky);
    ++factored_;
  }
  if (!kept_.back().usable) return false;
  find_rotations(rest, system, pool);
  return true;
}

// Quaternions are added up on one side of zero, that of the first; elements turned half around from each other may cancel.
void WarpedFactor::find_rotations(const RestBody& rest, const StepSystem& system, const ThreadPool& pool) {
  const int n = system.node_count();
  q_.resize(system.tets.size());
  const auto tets = [&](int begin, int end) {
    for (int t = begin; t < end; ++t) q_[t] = rotation_of(rest, system, t);
  };
  pool.for_chunks(static_cast<int>(q_.size()), kTetsPerChunk, std::cref(tets));
  R_.resize(n);
  const auto nodes = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (const int t : stars_[i]) {
        const Eigen::Vector4d q = rest.volume[t] * q_[t].coeffs();
        sum += q.dot(sum) < 0 ? Eigen::Vector4d(-q) : q;
      }
      const double size = sum.norm();
      R_[i] = size > 0 && std::isfinite(size) ? Quat(Eigen::Vector4d(sum / size)).toRotationMatrix() : Mat3::Identity();
    }
  };
  pool.for_chunks(n, kNodesPerChunk, std::cref(nodes));
}

void WarpedFactor::apply(Eigen::Ref<const VectorXd> r, Eigen::Ref<VectorXd> z) {
  assert(!kept_.empty() && kept_.back().usable && r.size() == 3 * static_cast<Eigen::Index>(R_.size()) && z.size() == r.size());
  turned_.resize(r.size());
  const int n = static_cast<int>(R_.size());
  for (int i = 0; i < n; ++i) turned_.segment<3>(3 * i).noalias() = R_[i].transpose() * r.segment<3>(3 * i);
  kept_.back().solve.solve(turned_.data(), turned_.data());
  for (int i = 0; i < n; ++i) z.segment<3>(3 * i).noalias() = R_[i] * turned_.segment<3>(3 * i);
}

}  // namespace crumple::sim::fem
