#include "server/sim/contact/contact_rows.h"

#include "server/sim/cross_matrix.h"
#include "server/sim/quad.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <numeric>

namespace crumple::sim::contact {
namespace {

constexpr int kRowChunk = 64;  // rows or blocks a task

}  // namespace

void ContactRows::assign(std::span<ContactRow> rows, std::span<const int> first_block, int block_count) {
  constexpr int kUsual = 8;  // entries of a row: four nodes on either side
  rows_ = rows;
  entries_.clear();
  entries_.reserve(kUsual * size());
  of_row_.clear(kUsual * size(), size());
  row_start_.assign(1, 0);
  row_start_.reserve(size() + 1);
  for (int k = 0; k < size(); ++k) {
    push_side(k, 0, first_block);
    push_side(k, 1, first_block);
    row_start_.push_back(static_cast<int>(entries_.size()));
    for (int e = row_start_[k]; e < row_start_[k + 1]; ++e) of_row_.push(entries_[e], entries_[e].block);
    of_row_.close();
  }
  // By counting: entries of a block stay in the order of their rows.
  start_.assign(block_count + 1, 0);
  order_.resize(entries_.size());
  for (const Entry& entry : entries_) {
    assert(entry.block >= 0 && entry.block < block_count);
    ++start_[entry.block + 1];
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  next_.assign(start_.begin(), start_.end() - 1);
  for (int e = 0; e < static_cast<int>(entries_.size()); ++e) order_[next_[entries_[e].block]++] = e;
  of_block_.clear(static_cast<int>(entries_.size()), block_count);
  touched_.clear();
  for (int block = 0; block < block_count; ++block) {
    if (start_[block] == start_[block + 1]) continue;
    for (int i = start_[block]; i < start_[block + 1]; ++i) of_block_.push(entries_[order_[i]], entries_[order_[i]].row);
    of_block_.close();
    touched_.push_back(block);
  }
  D_.resize(rows_.size());
  f_.assign(rows_.size(), Eigen::Vector4d::Zero());
  refresh();
}

void ContactRows::push_side(int row, int side, std::span<const int> first_block) {
  const ContactSide& s = rows_[row].sides[side];
  if (s.node_count == 0 && !s.rigid) return;
  const int first = first_block[s.body];
  for (int i = 0; i < s.node_count; ++i) entries_.push_back({row, first + s.nodes[i], s.weights[i], Vec3::Zero()});
  if (!s.rigid) return;
  const double sign = side == 0 ? 1 : -1;
  entries_.push_back({row, first, sign, Vec3::Zero()});
  entries_.push_back({row, first + 1, 0, sign * s.arm});
}

void ContactRows::refresh() {
  for (int k = 0; k < size(); ++k) {
    const ContactRow& row = rows_[k];
    D_[k] = row.c_t * Mat3::Identity() + (row.c_n - row.c_t) * row.normal * row.normal.transpose();
    if (!row.active) D_[k].setZero();
  }
}

void ContactRows::Lists::push(const Entry& entry, int other) {
  if (entry.weight != 0) weighted.push_back({other, entry.weight});
  else turned.push_back({other, entry.arm});
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

Vec3 ContactRows::gather(int k, const Eigen::VectorXd& x) const {
  Quad sum{};
  for (int e = of_row_.weighted_start[k]; e < of_row_.weighted_start[k + 1]; ++e)
    sum = multiply_add(load_three(x.data() + 3 * of_row_.weighted[e].other), quad(of_row_.weighted[e].weight), sum);
  Vec3 u(sum[0], sum[1], sum[2]);
  for (int e = of_row_.turned_start[k]; e < of_row_.turned_start[k + 1]; ++e)
    u += x.segment<3>(3 * of_row_.turned[e].other).cross(of_row_.turned[e].arm);
  return u;
}

Vec3 ContactRows::relative_velocity(int k, const Eigen::VectorXd& x) const {
  return rows_[k].known_velocity + gather(k, x);
}

void ContactRows::apply_add(const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const {
  if (touched_.empty()) return;
  find_forces(x, pool);
  const auto blocks = [&](int begin, int end) { add_forces(begin, end, y); };
  pool.for_chunks(touched_.back() + 1, kRowChunk, std::cref(blocks));
}

void ContactRows::find_forces(const Eigen::VectorXd& x, const ThreadPool& pool) const {
  const auto rows = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      if (rows_[k].active) f_[k].head<3>() = D_[k] * gather(k, x);
      else f_[k].setZero();
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

void ContactRows::add_to_diagonal(std::span<Mat3> blocks) const {
  for (const Entry& entry : entries_) {
    const Mat3& D = D_[entry.row];
    if (entry.weight != 0) {
      blocks[entry.block] += entry.weight * entry.weight * D;
    } else {
      const Mat3 A = cross_matrix(entry.arm);  // its block of W is -A
      blocks[entry.block] += A.transpose() * D * A;
    }
  }
}

void ContactRows::append_to(std::vector<Eigen::Triplet<double>>& entries) const {
  // u += B x_block: the block of W is B.
  const auto coefficient = [](const Entry& e) -> Mat3 { return e.weight * Mat3::Identity() - cross_matrix(e.arm); };
  for (int k = 0; k < size(); ++k) {
    if (!rows_[k].active) continue;
    for (int e = row_start_[k]; e < row_start_[k + 1]; ++e)
      for (int f = row_start_[k]; f < row_start_[k + 1]; ++f) {
        const Mat3 block = coefficient(entries_[e]).transpose() * D_[k] * coefficient(entries_[f]);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) entries.emplace_back(3 * entries_[e].block + i, 3 * entries_[f].block + j, block(i, j));
      }
  }
}

void ContactRows::add_to_rhs(Eigen::VectorXd& b) const {
  for (const Entry& entry : entries_) {
    const ContactRow& row = rows_[entry.row];
    if (!row.active) continue;
    const Vec3 f = row.c_n * row.target * row.normal + row.t0 - D_[entry.row] * row.known_velocity;
    b.segment<3>(3 * entry.block) += entry.weight * f + entry.arm.cross(f);
  }
}

}  // namespace crumple::sim::contact
