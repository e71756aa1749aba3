#include "server/sim/contact/contact_rows.h"

#include "server/sim/cross_matrix.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <functional>
#include <utility>

namespace crumple::sim::contact {
namespace {

constexpr int kRowChunk = 64;  // rows or blocks a task

}  // namespace

void ContactRows::assign(std::span<ContactRow> rows, std::span<const int> first_block, int block_count) {
  constexpr int kUsual = 8;  // entries of a row: four nodes on either side
  rows_ = rows;
  of_row_.clear(kUsual * size(), size());
  for (const ContactRow& row : rows) {
    push_side(row.sides[0], 1, first_block);
    push_side(row.sides[1], -1, first_block);
    of_row_.close();
  }
  list_by_block(block_count);
  D_.resize(rows_.size());
  f_.assign(rows_.size(), Eigen::Vector4d::Zero());
}

void ContactRows::push_side(const ContactSide& side, double sign, std::span<const int> first_block) {
  if (side.node_count == 0 && !side.rigid) return;
  const int first = first_block[side.body];
  // A weight of exactly zero is an entry all the same: it moves no sum.
  for (int i = 0; i < side.node_count; ++i) of_row_.weighted.push_back({first + side.nodes[i], side.weights[i]});
  if (!side.rigid) return;
  of_row_.weighted.push_back({first, sign});
  of_row_.turned.push_back({first + 1, sign * side.arm});
}

// By counting: entries of a block stay in the order of their rows.
void ContactRows::list_by_block(int block_count) {
  next_.assign(block_count, {0, 0});
  const auto count = [&](int block, int kind) {
    assert(block >= 0 && block < block_count);
    ++next_[block][kind];
  };
  for (const Lists::Weighted& entry : of_row_.weighted) count(entry.other, 0);
  for (const Lists::Turned& entry : of_row_.turned) count(entry.other, 1);
  of_block_.clear(0, block_count);
  touched_.clear();
  std::array<int, 2> end{0, 0};
  for (int block = 0; block < block_count; ++block) {
    const auto [weighted, turned] = std::exchange(next_[block], end);
    if (weighted + turned == 0) continue;
    touched_.push_back(block);
    of_block_.weighted_start.push_back(end[0] += weighted);
    of_block_.turned_start.push_back(end[1] += turned);
  }
  of_block_.weighted.resize(end[0]);
  of_block_.turned.resize(end[1]);
  for (int row = 0; row < size(); ++row) {
    for (int e = of_row_.weighted_start[row]; e < of_row_.weighted_start[row + 1]; ++e)
      of_block_.weighted[next_[of_row_.weighted[e].other][0]++] = {row, of_row_.weighted[e].weight};
    for (int e = of_row_.turned_start[row]; e < of_row_.turned_start[row + 1]; ++e)
      of_block_.turned[next_[of_row_.turned[e].other][1]++] = {row, of_row_.turned[e].arm};
  }
}

void ContactRows::refresh(const ThreadPool& pool) {
  const auto rows = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const ContactRow& row = rows_[k];
      D_[k] = row.c_t * Mat3::Identity() + (row.c_n - row.c_t) * row.normal * row.normal.transpose();
      if (!row.active) D_[k].setZero();
    }
  };
  pool.for_chunks(size(), kRowChunk, std::cref(rows));
}

void ContactRows::Lists::clear(int entries, int lists) {
  weighted.clear();
  weighted.reserve(entries);
  turned.clear();
  for (std::vector<int>* start : {&weighted_start, &turned_start}) {
    start->assign(1, 0);
    start->reserve(lists + 1);
  }
}

void ContactRows::Lists::close() {
  weighted_start.push_back(static_cast<int>(weighted.size()));
  turned_start.push_back(static_cast<int>(turned.size()));
}

Quad ContactRows::gather(int k, const Eigen::VectorXd& x) const {
  Quad sum{};
  for (int e = of_row_.weighted_start[k]; e < of_row_.weighted_start[k + 1]; ++e)
    sum = multiply_add(load_three(x.data() + 3 * of_row_.weighted[e].other), quad(of_row_.weighted[e].weight), sum);
  for (int e = of_row_.turned_start[k]; e < of_row_.turned_start[k + 1]; ++e) {
    const Vec3 turn = x.segment<3>(3 * of_row_.turned[e].other).cross(of_row_.turned[e].arm);
    sum += Quad{turn.x(), turn.y(), turn.z(), 0};
  }
  return sum;
}

Vec3 ContactRows::relative_velocity(int k, const Eigen::VectorXd& x) const {
  const Quad u = gather(k, x);
  return rows_[k].known_velocity + Vec3(u[0], u[1], u[2]);
}

void ContactRows::apply_add(const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const {
  find_forces(x, pool);
  scatter(y, pool);
}

void ContactRows::scatter(Eigen::VectorXd& y, const ThreadPool& pool) const {
  if (touched_.empty()) return;
  const auto blocks = [&](int begin, int end) { add_forces(begin, end, y); };
  pool.for_chunks(touched_.back() + 1, kRowChunk, std::cref(blocks));
}

void ContactRows::find_forces(const Eigen::VectorXd& x, const ThreadPool& pool) const {
  const auto rows = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      if (!rows_[k].active) {
        f_[k].setZero();
        continue;
      }
      const Quad u = gather(k, x);
      const double* D = D_[k].data();
      const Quad f = multiply_add(load_three(D + 6), quad(u[2]), multiply_add(load_four(D + 3), quad(u[1]), load_four(D) * quad(u[0])));
      std::memcpy(f_[k].data(), &f, sizeof f);  // the fourth lane is of no use
    }
  };
  pool.for_chunks(size(), kRowChunk, std::cref(rows));
}

void ContactRows::add_forces(int begin, int end, Eigen::VectorXd& y) const {
  const auto first = std::ranges::lower_bound(touched_, begin);
  for (int b = static_cast<int>(first - touched_.begin()); b < static_cast<int>(touched_.size()) && touched_[b] < end; ++b) {
    Quad sum{};
    for (int e = of_block_.weighted_start[b]; e < of_block_.weighted_start[b + 1]; ++e)
      sum = multiply_add(load_four(f_[of_block_.weighted[e].other].data()), quad(of_block_.weighted[e].weight), sum);
    Vec3 force(sum[0], sum[1], sum[2]);
    for (int e = of_block_.turned_start[b]; e < of_block_.turned_start[b + 1]; ++e)
      force += of_block_.turned[e].arm.cross(f_[of_block_.turned[e].other].head<3>());
    y.segment<3>(3 * touched_[b]) += force;
  }
}

void ContactRows::add_to_diagonal(std::span<Mat3> blocks, const ThreadPool& pool) const {
  const auto add = [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      Mat3& block = blocks[touched_[b]];
      for (int e = of_block_.weighted_start[b]; e < of_block_.weighted_start[b + 1]; ++e) {
        const auto& [row, weight] = of_block_.weighted[e];
        block += weight * weight * D_[row];
      }
      for (int e = of_block_.turned_start[b]; e < of_block_.turned_start[b + 1]; ++e) {
        const Mat3 A = cross_matrix(of_block_.turned[e].arm);  // its block of W is -A
        block += A.transpose() * D_[of_block_.turned[e].other] * A;
      }
    }
  };
  pool.for_chunks(static_cast<int>(touched_.size()), kRowChunk, std::cref(add));
}

void ContactRows::append_to(std::vector<Eigen::Triplet<double>>& entries) const {
  // u += B x_block: the block of W is B.
  const auto coefficient = [](const Entry& e) -> Mat3 { return e.weight * Mat3::Identity() - cross_matrix(e.arm); };
  for (int k = 0; k < size(); ++k) {
    if (!rows_[k].active) continue;
    for_entries(k, [&](const Entry& e) {
      for_entries(k, [&](const Entry& f) {
        const Mat3 block = coefficient(e).transpose() * D_[k] * coefficient(f);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) entries.emplace_back(3 * e.block + i, 3 * f.block + j, block(i, j));
      });
    });
  }
}

void ContactRows::add_to_rhs(Eigen::VectorXd& b, const ThreadPool& pool) const {
  const auto rows = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const ContactRow& row = rows_[k];
      f_[k].setZero();
      if (row.active) f_[k].head<3>() = row.c_n * row.target * row.normal + row.t0 - D_[k] * row.known_velocity;
    }
  };
  pool.for_chunks(size(), kRowChunk, std::cref(rows));
  scatter(b, pool);
}

}  // namespace crumple::sim::contact
