#include "server/sim/contact/contact_rows.h"

#include "server/sim/cross_matrix.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::contact {
namespace {

constexpr int kRowChunk = 256;  // rows or blocks a task

}  // namespace

ContactRows::ContactRows(std::span<ContactRow> rows, std::span<const int> first_block, int block_count) : rows_(rows) {
  row_start_.push_back(0);
  for (int k = 0; k < size(); ++k) {
    push_side(k, 0, first_block);
    push_side(k, 1, first_block);
    row_start_.push_back(static_cast<int>(entries_.size()));
  }
  by_block_ = entries_;
  std::stable_sort(by_block_.begin(), by_block_.end(), [](const Entry& a, const Entry& b) { return a.block < b.block; });
  for (int e = 0; e < static_cast<int>(by_block_.size()); ++e) {
    assert(by_block_[e].block >= 0 && by_block_[e].block < block_count);
    if (e == 0 || by_block_[e].block != by_block_[e - 1].block) block_start_.push_back(e);
  }
  block_start_.push_back(static_cast<int>(by_block_.size()));
  D_.resize(rows_.size());
  f_.resize(rows_.size());
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

Vec3 ContactRows::gather(int k, const Eigen::VectorXd& x) const {
  Vec3 u = Vec3::Zero();
  for (int e = row_start_[k]; e < row_start_[k + 1]; ++e) {
    const Vec3 v = x.segment<3>(3 * entries_[e].block);
    u += entries_[e].weight * v + v.cross(entries_[e].arm);
  }
  return u;
}

Vec3 ContactRows::relative_velocity(int k, const Eigen::VectorXd& x) const {
  return rows_[k].known_velocity + gather(k, x);
}

void ContactRows::scatter_add(std::span<const Vec3> f, Eigen::VectorXd& y, const ThreadPool& pool) const {
  pool.for_chunks(static_cast<int>(block_start_.size()) - 1, kRowChunk, [&](int begin, int end) {
    for (int b = begin; b < end; ++b) {
      Vec3 sum = Vec3::Zero();
      for (int e = block_start_[b]; e < block_start_[b + 1]; ++e) {
        const Entry& entry = by_block_[e];
        sum += entry.weight * f[entry.row] + entry.arm.cross(f[entry.row]);
      }
      y.segment<3>(3 * by_block_[block_start_[b]].block) += sum;
    }
  });
}

void ContactRows::apply_add(const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const {
  if (rows_.empty()) return;
  pool.for_chunks(size(), kRowChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      f_[k] = rows_[k].active ? Vec3(D_[k] * gather(k, x)) : Vec3(Vec3::Zero());
  });
  scatter_add(f_, y, pool);
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
