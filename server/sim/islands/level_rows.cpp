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

LevelRows::LevelRows(const contact::ContactRows& rows) : D_(std::make_shared<std::vector<Mat3>>(rows.coefficients())) {
  row_start_.assign(rows.row_start().begin(), rows.row_start().end());
  for (const auto& e : rows.entries()) entries_.push_back({e.row, e.block, static_cast<float>(e.weight), to_lanes(e.arm)});
  index();
}

LevelRows LevelRows::coarser(const Follow& follow) const {
  LevelRows coarse;
  coarse.D_ = D_;
  if (row_start_.empty()) return coarse;
  coarse.row_start_.push_back(0);
  std::vector<Entry> becomes;
  for (std::size_t row = 0; row + 1 < row_start_.size(); ++row) {
    const std::size_t first = coarse.entries_.size();
    for (int e = row_start_[row]; e < row_start_[row + 1]; ++e) {
      becomes.clear();
      follow(entries_[e], becomes);
      for (const Entry& entry : becomes) {
        const auto same = std::find_if(coarse.entries_.begin() + static_cast<std::ptrdiff_t>(first), coarse.entries_.end(), [&](const Entry& other) {
          return other.block == entry.block && (other.weight != 0) == (entry.weight != 0);
        });
        if (same == coarse.entries_.end() || entry.weight == 0) coarse.entries_.push_back(entry);
        else same->weight += entry.weight;
      }
    }
    coarse.row_start_.push_back(static_cast<int>(coarse.entries_.size()));
  }
  coarse.index();
  return coarse;
}

void LevelRows::index() {
  int blocks = 0;
  for (const Entry& e : entries_) blocks = std::max(blocks, e.block + 1);
  std::vector<int> start(blocks + 1, 0);
  for (const Entry& e : entries_) ++start[e.block + 1];
  for (int b = 0; b < blocks; ++b) {
    if (start[b + 1] > 0) {
      touched_.push_back(b);
      touch_start_.push_back(start[b]);
    }
    start[b + 1] += start[b];
  }
  touch_start_.push_back(static_cast<int>(entries_.size()));
  by_block_.resize(entries_.size());
  for (int e = 0; e < static_cast<int>(entries_.size()); ++e) by_block_[start[entries_[e].block]++] = e;
  for (const Mat3& D : *D_) lane_D_.push_back(LaneBlock(D));
  f_.resize(D_->size());
}

void LevelRows::product(const Lanes* x, const ThreadPool& pool) {
  if (empty()) return;
  pool.for_chunks(static_cast<int>(f_.size()), kRowsPerChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      Lanes u{};
      for (int e = row_start_[k]; e < row_start_[k + 1]; ++e) {
        const Entry& entry = entries_[e];
        u = entry.weight != 0 ? multiply_add(x[entry.block], linear_solver::lanes(entry.weight), u)
                              : u + linear_solver::cross(x[entry.block], entry.arm);
      }
      f_[k] = multiply_add(lane_D_[k], u, Lanes{});
    }
  });
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
    const Mat3& D = (*D_)[row];
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
    const Mat3& D = (*D_)[row];
    if (D.isZero(0)) continue;
    for (int e = row_start_[row]; e < row_start_[row + 1]; ++e) {
      const Mat3 BD = coefficient(entries_[e]).transpose() * D;
      for (int g = row_start_[row]; g < row_start_[row + 1]; ++g)
        A.block<3, 3>(3 * entries_[e].block, 3 * entries_[g].block) += BD * coefficient(entries_[g]);
    }
  }
}

}  // namespace crumple::sim::islands
