#include "server/sim/linear_solver/block_jacobi.h"

#include "server/sim/quad.h"

#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>

namespace crumple::sim::linear_solver {

namespace {

constexpr int kBlocksPerChunk = 256;

Mat3 inverse_or_identity(const Mat3& D) {
  // Leading minors: positive definite without a square root.
  const double minor2 = D(0, 0) * D(1, 1) - D(0, 1) * D(1, 0);
  const double det = D.determinant();
  if (!(D(0, 0) > 0 && minor2 > 0 && det > 0)) return Mat3::Identity();
  const Mat3 inverse = D.inverse();
  if (!inverse.allFinite()) return Mat3::Identity();
  return 0.5 * (inverse + inverse.transpose());
}

// The fourth lane is of no use.
Quad times(const Mat3& B, const double* r) {
  const Quad first = multiply_add(load_four(B.data()), quad(r[0]), load_four(B.data() + 3) * r[1]);
  return multiply_add(load_three(B.data() + 6), quad(r[2]), first);
}

}  // namespace

void BlockJacobi::assign(std::span<const Mat3> diagonal) { blocks_.assign(diagonal.begin(), diagonal.end()); }

void BlockJacobi::invert(const ThreadPool& pool) {
  const auto body = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) blocks_[i] = inverse_or_identity(blocks_[i]);
  };
  pool.for_chunks(static_cast<int>(blocks_.size()), kBlocksPerChunk, std::cref(body));
}

void BlockJacobi::apply(Eigen::Ref<const Eigen::VectorXd> r, Eigen::Ref<Eigen::VectorXd> z,
                        const ThreadPool& pool) const {
  assert(r.size() == 3 * static_cast<Eigen::Index>(blocks_.size()) && z.size() == r.size());
  const auto body = [&](int begin, int end) { apply_blocks(begin, end, r.data(), z.data()); };
  pool.for_chunks(static_cast<int>(blocks_.size()), kBlocksPerChunk, std::cref(body));
}

void BlockJacobi::apply_blocks(int begin, int end, const double* r, double* z) const {
  for (int i = begin; i < end; ++i) store_three(times(blocks_[i], r + 3 * i), z + 3 * i);
}

double BlockJacobi::squared_norm(const Eigen::VectorXd& r, const ThreadPool& pool) const {
  assert(r.size() == 3 * static_cast<Eigen::Index>(blocks_.size()));
  partial_.assign((blocks_.size() + kBlocksPerChunk - 1) / kBlocksPerChunk, 0.0);
  const auto body = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const double* r_i = r.data() + 3 * i;
      const Quad z = times(blocks_[i], r_i);
      partial_[begin / kBlocksPerChunk] += r_i[0] * z[0] + r_i[1] * z[1] + r_i[2] * z[2];
    }
  };
  pool.for_chunks(static_cast<int>(blocks_.size()), kBlocksPerChunk, std::cref(body));
  return std::accumulate(partial_.begin(), partial_.end(), 0.0);
}

}  // namespace crumple::sim::linear_solver
