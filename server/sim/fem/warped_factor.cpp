#include "server/sim/fem/warped_factor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <span>

namespace crumple::sim::fem {

using Eigen::VectorXd;

namespace {

constexpr int kNodesPerChunk = 64;
constexpr int kNodesPerTurn = 256;
constexpr std::size_t kSamples = 6;        // elements a node, at most twice as many
constexpr double kLeastDeterminant = 0.1;  // of a mean of rotations that is near to one

// The system's matrix with every node at rest: the same masses, factors and struck rows.
Eigen::SparseMatrix<double> matrix_at_rest(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system,
                                           const StepSystem::Scale& scale, const ThreadPool& pool) {
  const int n = system.node_count();
  const FemState at_rest{X, std::vector<Vec3>(n, Vec3::Zero()), {}};
  std::vector<PrescribedNode> prescribed;
  for (int i = 0; i < n; ++i)
    if (system.prescribed[i]) prescribed.push_back({i, Vec3::Zero()});
  const StepFormula formula{.dt = scale.dt, .mass = scale.mass, .position = scale.position, .w = at_rest.v,
                            .x_known = X, .x_linear = X};
  StepSystem own;
  assemble(rest, system.tets, at_rest, formula, VectorXd::Zero(3 * n), prescribed, pool, own);
  Eigen::SparseMatrix<double> A = own.to_sparse();
  A.prune([](int, int, double value) { return value != 0; });  // what was struck
  return A;
}

// Stages of elimination that leave two halves of the body apart, for threads to substitute side by side: nodes below the middle of
// its longest side, then those above it that have no neighbour below, then the cut between them. One a row of the matrix.
std::vector<int> halves(const std::vector<Vec3>& X, const linear_solver::BlockPattern& pattern) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : X) box.extend(x);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  std::vector<double> places;
  for (const Vec3& x : X) places.push_back(x[axis]);
  const auto middle = places.begin() + static_cast<std::ptrdiff_t>(places.size() / 2);
  std::ranges::nth_element(places, middle);
  const auto is_below = [&](int i) { return X[i][axis] < *middle; };

  std::vector<int> stage;
  for (int i = 0; i < static_cast<int>(X.size()); ++i) {
    const std::span<const int> neighbours = std::span(pattern.columns).subspan(pattern.row_start[i], pattern.row_start[i + 1] - pattern.row_start[i]);
    stage.insert(stage.end(), 3, is_below(i) ? 0 : std::ranges::any_of(neighbours, is_below) ? 2 : 1);
  }
  return stage;
}

const std::shared_ptr<const linear_solver::BlockPattern>& pattern_of(const StepSystem& system) {
  return std::visit([](const auto& A) -> const auto& { return A.pattern(); }, system.A);
}

// weight Q of tet t onto the sum; of groups the mean of its two.
void add_rotation(const RestBody& rest, const StepSystem& system, int t, double weight, Mat3& sum) {
  if (!rest.grouped()) {
    sum += weight * system.elements.Q[t];
    return;
  }
  const std::vector<Mat3>& Q = system.elements.macros.Q;
  sum += 0.5 * weight * (Q[rest.macros.of_tet[2 * t]] + Q[rest.macros.of_tet[2 * t + 1]]);
}

}  // namespace

void WarpedFactor::make(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system, const StepSystem::Scale& scale,
                        const ThreadPool& pool) {
  assert(static_cast<int>(X.size()) == system.node_count());
  if (pattern_ != pattern_of(system)) {
    pattern_ = pattern_of(system);
    stars_ = NodeStars(system.tets, system.node_count());
    kept_.clear();
  }
  const auto known = std::ranges::find_if(kept_, [&](const Kept& k) { return k.is_of(scale, system.prescribed); });
  if (known != kept_.end()) {
    std::rotate(known, known + 1, kept_.end());
    return;
  }
  if (kept_.size() == kMostKept) kept_.erase(kept_.begin());
  Kept& made = kept_.emplace_back(Kept{scale, system.prescribed, false, {}});
  linear_solver::Cholesky cholesky;
  made.usable = cholesky.factor(matrix_at_rest(rest, X, system, scale, pool), halves(X, *pattern_));
  if (made.usable) made.solve = linear_solver::SupernodalSolve(cholesky);
  ++factored_;
}

bool WarpedFactor::has(const StepSystem& system) const {
  return pattern_ == pattern_of(system) && std::ranges::any_of(kept_, [&](const Kept& k) { return k.usable && k.is_of(system.scale, system.prescribed); });
}

bool WarpedFactor::update(const RestBody& rest, const std::vector<Vec3>& X, const StepSystem& system, const ThreadPool& pool) {
  make(rest, X, system, system.scale, pool);
  if (!kept_.back().usable) return false;
  find_rotations(rest, system, pool);
  return true;
}

// The rotation in the mean of a few elements' matrices: one step towards its polar factor, which leaves the square of what it is off,
// then what a quaternion makes of that. Elements turned half around from each other may cancel.
void WarpedFactor::find_rotations(const RestBody& rest, const StepSystem& system, const ThreadPool& pool) {
  const int n = system.node_count();
  R_.resize(n);
  const auto nodes = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const std::span<const int> star = stars_[i];
      const std::size_t stride = std::max<std::size_t>(1, star.size() / kSamples);
      Mat3 sum = Mat3::Zero();
      double weight = 0;
      for (std::size_t k = 0; k < star.size(); k += stride) {
        const double volume = rest.volume[star[k]];
        weight += volume;
        add_rotation(rest, system, star[k], volume, sum);
      }
      const Mat3 mean = sum / weight;
      R_[i] = mean.determinant() > kLeastDeterminant ? Quat(Mat3(0.5 * (mean + mean.inverse().transpose()))).normalized().toRotationMatrix()
                                                     : Mat3::Identity();
    }
  };
  pool.for_chunks(n, kNodesPerChunk, std::cref(nodes));
}

void WarpedFactor::apply(Eigen::Ref<const VectorXd> r, Eigen::Ref<VectorXd> z, const ThreadPool& pool) {
  assert(!kept_.empty() && kept_.back().usable && r.size() == 3 * static_cast<Eigen::Index>(R_.size()) && z.size() == r.size());
  turned_.resize(r.size());
  const int n = static_cast<int>(R_.size());
  const auto turn_back = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) turned_.segment<3>(3 * i).noalias() = R_[i].transpose() * r.segment<3>(3 * i);
  };
  pool.for_chunks(n, kNodesPerTurn, std::cref(turn_back));
  kept_.back().solve.solve(turned_.data(), turned_.data(), pool);
  const auto turn = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) z.segment<3>(3 * i).noalias() = R_[i] * turned_.segment<3>(3 * i);
  };
  pool.for_chunks(n, kNodesPerTurn, std::cref(turn));
}

}  // namespace crumple::sim::fem
