#include "server/sim/islands/level_rows.h"

#include "server/sim/cross_matrix.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::islands {
namespace {

using linear_solver::multiply_add;

constexpr int kRowsPerChunk = 64;

Lanes to_lanes(const Vec3& v) {
  return Lanes{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0};
}

double share(const LevelRows::Entry& e) { return e.weight != 0 ? std::abs(e.weight) : 0.5; }

}  // namespace

void LevelRows::assign(const contact::ContactRows& rows) {
  D_ = rows.coefficients();
  entries_.clear();
  row_start_.assign(1, 0);
  for (int row = 0; row < rows.size(); ++row) {
    rows.for_entries(row, [&](const contact::ContactRows::Entry& e) {
      entries_.push_back({e.row, e.block, static_cast<float>(e.weight), to_lanes(e.arm)});
    });
    row_start_.push_back(static_cast<int>(entries_.size()));
  }
  index();
}

void LevelRows::assign_coarser(const LevelRows& fine, const Follow& follow) {
  D_ = fine.D_;
  entries_.clear();
  row_start_.assign(1, 0);
  for (std::size_t row = 0; row + 1 < fine.row_start_.size(); ++row) {
    const std::size_t first = entries_.size();
    for (int e = fine.row_start_[row]; e < fine.row_start_[row + 1]; ++e) {
      becomes_.clear();
      follow(fine.entries_[e], becomes_);
      for (const Entry& entry : becomes_) {
        const auto same = std::find_if(entries_.begin() + static_cast<std::ptrdiff_t>(first), entries_.end(), [&](const Entry& other) {
          return other.block == entry.block && (other.weight != 0) == (entry.weight != 0);
        });
        if (same == entries_.end() || entry.weight == 0) entries_.push_back(entry);
        else same->weight += entry.weight;
      }
    }
    row_start_.push_back(static_cast<int>(entries_.size()));
  }
  index();
}

void LevelRows::index() {
  int blocks = 0;
  for (const Entry& e : entries_) blocks = std::max(blocks, e.block + 1);
  start_.assign(blocks + 1, 0);
  touched_.clear();
  touch_start_.clear();
  for (const Entry& e : entries_) ++start_[e.block + 1];
  for (int b = 0; b < blocks; ++b) {
    if (start_[b + 1] > 0) {
      touched_.push_back(b);
      touch_start_.push_back(start_[b]);
    }
    start_[b + 1] += start_[b];
  }
  touch_start_.push_back(static_cast<int>(entries_.size()));
  by_block_.resize(entries_.size());
  for (int e = 0; e < static_cast<int>(entries_.size()); ++e) by_block_[start_[entries_[e].block]++] = e;
  lane_D_.clear();
  for (const Mat3& D : D_) lane_D_.push_back(LaneBlock(D));
  f_.resize(D_.size());
}

void LevelRows::product(const Lanes* x, const ThreadPool& pool) {
  if (empty()) return;
  const auto rows = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      Lanes u{};
      for (int e = row_start_[k]; e < row_start_[k + 1]; ++e) {
        const Entry& entry = entries_[e];
        u = entry.weight != 0 ? multiply_add(x[entry.block], linear_solver::lanes(entry.weight), u)
                              : u + linear_solver::cross(x[entry.block], entry.arm);
      }
      f_[k] = multiply_add(lane_D_[k], u, Lanes{});
    }
  };
  pool.for_chunks(static_cast<int>(f_.size()), kRowsPerChunk, std::cref(rows));
}

int LevelRows::cursor(int block) const {
  return static_cast<int>(std::lower_bound(touched_.begin(), touched_.end(), block) - touched_.begin());
}

Lanes LevelRows::scatter(int block, int& cursor) const {
  Lanes sum{};
  if (cursor >= static_cast<int>(touched_.size()) || touched_[cursor] != block) return sum;
  for (int k = touch_start_[cursor]; k < touch_start_[cursor + 1]; ++k) {
    const Entry& entry = entries_[by_block_[k]];
    sum = entry.weight != 0 ? multiply_add(f_[entry.row], linear_solver::lanes(entry.weight), sum)
                            : sum + linear_solver::cross(entry.arm, f_[entry.row]);
  }
  ++cursor;
  return sum;
}

// B of u += B x: weight I, or the cross product with the arm from the right.
Mat3 LevelRows::coefficient(const Entry& e) const {
  if (e.weight != 0) return e.weight * Mat3::Identity();
  return -cross_matrix(Vec3(e.arm[0], e.arm[1], e.arm[2]));
}

void LevelRows::add_bound(double scale, std::span<Mat3> diagonal) const {
  for (std::size_t row = 0; row + 1 < row_start_.size(); ++row) {
    const Mat3& D = D_[row];
    if (D.isZero(0)) continue;
    double sum = 0;
    for (int e = row_start_[row]; e < row_start_[row + 1]; ++e) sum += share(entries_[e]);
    for (int e = row_start_[row]; e < row_start_[row + 1]; ++e) {
      const Mat3 B = coefficient(entries_[e]);
      diagonal[entries_[e].block] += scale * sum / share(entries_[e]) * (B.transpose() * D * B);
    }
  }
}

void LevelRows::add_to_dense(Eigen::MatrixXd& A) const {
  for (std::size_t row = 0; row + 1 < row_start_.size(); ++row) {
    const Mat3& D = D_[row];
    if (D.isZero(0)) continue;
    for (int e = row_start_[row]; e < row_start_[row + 1]; ++e) {
      const Mat3 BD = coefficient(entries_[e]).transpose() * D;
      for (int g = row_start_[row]; g < row_start_[row + 1]; ++g)
        A.block<3, 3>(3 * entries_[e].block, 3 * entries_[g].block) += BD * coefficient(entries_[g]);
    }
  }
}

}  // namespace crumple::sim::islands
