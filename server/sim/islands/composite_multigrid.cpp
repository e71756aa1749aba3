#include "server/sim/islands/composite_multigrid.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <functional>
#include <utility>

namespace crumple::sim::islands {
namespace {

using linear_solver::load_lanes;
using linear_solver::multiply_add;

constexpr int kRowsPerChunk = 64;  // some 2 us
// The polynomial's interval, as parts of its upper end. Degree one still smooths at that and kLow of it. Measured on every
// level of meshes of tets, whose bound is 4: up to 2.4 in whole meshes, 3.3 in broken ones.
constexpr double kHigh = 3.7 / 4;      // of the largest spectral bound of the island's bodies
constexpr double kLow = 1.0 / 10;      // what a level leaves to the next one
constexpr int kSmoothing = 1;          // degree, before and after: 2 saves a third of the iterations and costs two thirds more each
constexpr int kMostDenseBlocks = 40;   // of the coarsest level; above it is smoothed for long instead
constexpr int kCoarsestSmoothing = 8;
constexpr double kCoarsestLow = 1.0 / 60;

LaneBlock inverse_or_identity(const Mat3& D) {
  const double minor = D(0, 0) * D(1, 1) - D(0, 1) * D(1, 0), det = D.determinant();
  if (!(D(0, 0) > 0 && minor > 0 && det > 0)) return LaneBlock(Mat3::Identity());
  const Mat3 inverse = D.inverse();
  if (!inverse.allFinite()) return LaneBlock(Mat3::Identity());
  return LaneBlock(0.5 * (inverse + inverse.transpose()));
}

}  // namespace

CompositeMultigrid::LevelPart::LevelPart(const MultigridPart& part)
    : values(part.hierarchy->finest()), diagonal(part.system->diagonal()), first(part.first_block), count(part.system->node_count()) {
  std::visit([&](const auto& A) { row_start = A.row_start(), columns = A.columns(); }, part.system->A);
  if (!part.hierarchy->levels().empty()) transfer = &part.hierarchy->levels().front().transfer;
}

void CompositeMultigrid::LevelPart::follow(const linear_solver::MultigridHierarchy::Level& level) {
  row_start = level.A.row_start();
  columns = level.A.columns();
  values = level.A.values();
  diagonal = level.A.diagonal();
}

inline Lanes CompositeMultigrid::LevelPart::product(int i, const Lanes* x) const {
  Lanes s0{}, s1{}, s2{};
  const int stop = row_start[i + 1];
  for (int k = row_start[i]; k < stop; ++k) {
    const float* B = values + 9 * static_cast<std::ptrdiff_t>(k);
    const float* v = reinterpret_cast<const float*>(x + columns[k]);
    s0 = multiply_add(load_lanes(B), linear_solver::lanes(v[0]), s0);
    s1 = multiply_add(load_lanes(B + 3), linear_solver::lanes(v[1]), s1);
    s2 = multiply_add(load_lanes(B + 6), linear_solver::lanes(v[2]), s2);
  }
  return s0 + s1 + s2;
}

void CompositeMultigrid::assign(std::span<const MultigridPart> parts, std::span<const Mat3> rigid,
                                const contact::ContactRows& rows, const ThreadPool& pool) {
  pool_ = &pool;
  rigid_.assign(rigid.begin(), rigid.end());
  high_ = 0;
  std::size_t deepest = 0;
  for (const MultigridPart& part : parts) deepest = std::max(deepest, part.hierarchy->levels().size());
  level_count_ = static_cast<int>(deepest) + 1;
  if (levels_.size() < deepest + 1) levels_.resize(deepest + 1);

  Level& finest = levels_.front();
  finest.parts.clear();
  finest.rigid_first = 0;
  for (const MultigridPart& part : parts) {
    high_ = std::max(high_, kHigh * part.system->spectral_bound);
    finest.parts.emplace_back(part);
    finest.rigid_first = part.first_block + part.system->node_count();
  }
  finest.blocks = finest.rigid_first + static_cast<int>(rigid_.size());
  finest.rows.assign(rows);
  for (std::size_t l = 0; l < deepest; ++l) {
    Level& level = levels_[l + 1];
    make_coarser_level(levels_[l], level);
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const auto& own = parts[p].hierarchy->levels();
      if (l < own.size()) level.parts[p].follow(own[l]);
      level.parts[p].transfer = l + 1 < own.size() ? &own[l + 1].transfer : nullptr;
    }
  }
  for (int l = 0; l < level_count_; ++l) prepare(levels_[l]);
  factor_coarsest();
}

void CompositeMultigrid::make_coarser_level(Level& fine, Level& coarse) {
  coarse.parts.clear();
  coarse.rigid_first = 0;
  for (LevelPart& part : fine.parts) {
    part.coarse_first = coarse.rigid_first;
    LevelPart below = part;
    below.first = coarse.rigid_first;
    below.count = part.transfer ? part.transfer->coarse_count() : part.count;
    coarse.rigid_first += below.count;
    coarse.parts.push_back(below);
  }
  fine.coarse_rigid_first = coarse.rigid_first;
  coarse.blocks = coarse.rigid_first + static_cast<int>(rigid_.size());
  const auto follow = [&](const LevelRows::Entry& entry, std::vector<LevelRows::Entry>& becomes) {
    LevelRows::Entry below = entry;
    if (entry.block >= fine.rigid_first) {
      below.block += fine.coarse_rigid_first - fine.rigid_first;
      becomes.push_back(below);
      return;
    }
    const auto after = std::upper_bound(fine.parts.begin(), fine.parts.end(), entry.block,
                                        [](int block, const LevelPart& part) { return block < part.first; });
    const LevelPart& part = *(after - 1);
    const int i = entry.block - part.first;
    if (!part.transfer) {
      below.block = part.coarse_first + i;
      becomes.push_back(below);
      return;
    }
    for (int k = part.transfer->row_start[i]; k < part.transfer->row_start[i + 1]; ++k) {
      below.block = part.coarse_first + part.transfer->coarse[k];
      below.weight = entry.weight * part.transfer->weight[k];
      becomes.push_back(below);
    }
  };
  coarse.rows.assign_coarser(fine.rows, std::cref(follow));
}

void CompositeMultigrid::prepare(Level& level) {
  bound_.resize(level.blocks);
  level.diagonal.resize(level.blocks);
  level.smoother.resize(level.blocks);
  for (std::vector<Lanes>* v : {&level.b, &level.x, &level.next, &level.d}) v->resize(level.blocks);
  const auto gather = [&](int begin, int end) {
    for (const LevelPart& part : level.parts)
      for (int i = std::max(begin, part.first); i < std::min(end, part.first + part.count); ++i) bound_[i] = part.diagonal[i - part.first];
    for (int i = std::max(begin, level.rigid_first); i < end; ++i) bound_[i] = rigid_[i - level.rigid_first];
    for (int i = begin; i < end; ++i) level.diagonal[i] = LaneBlock(bound_[i]);
  };
  pool_->for_chunks(level.blocks, kRowsPerChunk, std::cref(gather));
  level.rows.add_bound(1 / high_, bound_);
  const auto invert = [&](int begin, int end) {
    for (int i = begin; i < end; ++i) level.smoother[i] = inverse_or_identity(bound_[i]);
  };
  pool_->for_chunks(level.blocks, kRowsPerChunk, std::cref(invert));
}

void CompositeMultigrid::factor_coarsest() {
  const Level& level = levels_[level_count_ - 1];
  dense_ = false;
  if (level.blocks > kMostDenseBlocks) return;
  Eigen::MatrixXd& A = dense_A_;
  A.setZero(3 * level.blocks, 3 * level.blocks);
  for (const LevelPart& part : level.parts)
    for (int i = 0; i < part.count; ++i) {
      const int row = 3 * (part.first + i);
      A.block<3, 3>(row, row) = part.diagonal[i];
      for (int k = part.row_start[i]; k < part.row_start[i + 1]; ++k)
        A.block<3, 3>(row, 3 * (part.first + part.columns[k])) = Eigen::Map<const Eigen::Matrix3f>(part.values + 9 * k).cast<double>();
    }
  for (std::size_t k = 0; k < rigid_.size(); ++k) {
    const Eigen::Index at = 3 * (level.rigid_first + static_cast<Eigen::Index>(k));
    A.block<3, 3>(at, at) = rigid_[k];
  }
  level.rows.add_to_dense(A);
  coarsest_.compute(A);
  dense_ = coarsest_.info() == Eigen::Success;
  dense_b_.resize(A.rows());
}

// finish(i, A x of row i) for every row of the level, x being level.x.
template <class Finish>
void CompositeMultigrid::each_row(Level& level, const Finish& finish) const {
  level.rows.product(level.x.data(), *pool_);
  const bool rows = !level.rows.empty();
  const auto chunk = [&](int begin, int end) {
    int cursor = rows ? level.rows.cursor(begin) : 0;
    const auto complete = [&](int i, Lanes Ax) {
      Ax = multiply_add(level.diagonal[i], level.x[i], Ax);
      if (rows) Ax += level.rows.scatter(i, cursor);
      finish(i, Ax);
    };
    for (const LevelPart& part : level.parts) {
      const Lanes* x = level.x.data() + part.first;
      const int last = std::min(end, part.first + part.count);
      for (int i = std::max(begin, part.first); i < last; ++i) complete(i, part.product(i - part.first, x));
    }
    for (int i = std::max(begin, level.rigid_first); i < end; ++i) complete(i, Lanes{});
  };
  pool_->for_chunks(level.blocks, kRowsPerChunk, std::cref(chunk));
}

// x := x + p(D^-1 A) D^-1 (b - A x), p the Chebyshev polynomial that is small on [low high_, high_].
void CompositeMultigrid::smooth(Level& level, int steps, double low, bool from_zero) const {
  const double middle = 0.5 * high_ * (1 + low), half = 0.5 * high_ * (1 - low), sigma = middle / half;
  double rho = 1 / sigma;
  for (int step = 0; step < steps; ++step) {
    float keep = 0, take = static_cast<float>(1 / middle);
    if (step > 0) {
      const double rho_next = 1 / (2 * sigma - rho);
      keep = static_cast<float>(rho_next * rho);
      take = static_cast<float>(2 * rho_next / half);
      rho = rho_next;
    }
    if (step == 0 && from_zero) {
      const auto first = [&](int begin, int end) {
        for (int i = begin; i < end; ++i)
          level.x[i] = level.d[i] = linear_solver::lanes(take) * multiply_add(level.smoother[i], level.b[i], Lanes{});
      };
      pool_->for_chunks(level.blocks, kRowsPerChunk, std::cref(first));
      continue;
    }
    each_row(level, [&](int i, Lanes Ax) {
      const Lanes correction = multiply_add(level.smoother[i], level.b[i] - Ax, Lanes{});
      const Lanes d = step == 0 ? linear_solver::lanes(take) * correction
                                : multiply_add(correction, linear_solver::lanes(take), linear_solver::lanes(keep) * level.d[i]);
      level.d[i] = d;
      level.next[i] = level.x[i] + d;
    });
    level.x.swap(level.next);
  }
}

void CompositeMultigrid::solve_coarsest(Level& level) {
  if (!dense_) {
    smooth(level, kCoarsestSmoothing, kCoarsestLow, true);
    return;
  }
  for (int i = 0; i < level.blocks; ++i)
    for (int j = 0; j < 3; ++j) dense_b_[3 * i + j] = level.b[i][j];
  coarsest_.solveInPlace(dense_b_);
  for (int i = 0; i < level.blocks; ++i)
    level.x[i] = Lanes{static_cast<float>(dense_b_[3 * i]), static_cast<float>(dense_b_[3 * i + 1]), static_cast<float>(dense_b_[3 * i + 2]), 0};
}

void CompositeMultigrid::cycle(std::size_t l) {
  Level& level = levels_[l];
  if (static_cast<int>(l) + 1 == level_count_) {
    solve_coarsest(level);
    return;
  }
  smooth(level, kSmoothing, kLow, true);
  each_row(level, [&](int i, Lanes Ax) { level.next[i] = level.b[i] - Ax; });

  Level& coarse = levels_[l + 1];
  for (const LevelPart& part : level.parts) {
    if (!part.transfer) {
      std::copy_n(level.next.begin() + part.first, part.count, coarse.b.begin() + part.coarse_first);
      continue;
    }
    const linear_solver::LevelTransfer& t = *part.transfer;
    const auto restrict_to = [&](int begin, int end) {
      for (int I = begin; I < end; ++I) {
        Lanes sum{};
        for (int k = t.column_start[I]; k < t.column_start[I + 1]; ++k)
          sum = multiply_add(level.next[part.first + t.fine[k]], linear_solver::lanes(t.column_weight[k]), sum);
        coarse.b[part.coarse_first + I] = sum;
      }
    };
    pool_->for_chunks(t.coarse_count(), kRowsPerChunk, std::cref(restrict_to));
  }
  std::copy(level.next.begin() + level.rigid_first, level.next.end(), coarse.b.begin() + coarse.rigid_first);
  cycle(l + 1);
  for (const LevelPart& part : level.parts) {
    if (!part.transfer) {
      for (int i = 0; i < part.count; ++i) level.x[part.first + i] += coarse.x[part.coarse_first + i];
      continue;
    }
    const linear_solver::LevelTransfer& t = *part.transfer;
    const auto prolong = [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        Lanes sum = level.x[part.first + i];
        for (int k = t.row_start[i]; k < t.row_start[i + 1]; ++k)
          sum = multiply_add(coarse.x[part.coarse_first + t.coarse[k]], linear_solver::lanes(t.weight[k]), sum);
        level.x[part.first + i] = sum;
      }
    };
    pool_->for_chunks(part.count, kRowsPerChunk, std::cref(prolong));
  }
  for (int i = level.rigid_first; i < level.blocks; ++i) level.x[i] += coarse.x[coarse.rigid_first + i - level.rigid_first];
  smooth(level, kSmoothing, kLow, false);
}

void CompositeMultigrid::apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) {
  Level& finest = levels_.front();
  assert(r.size() == 3 * finest.blocks && z.size() == r.size());
  const auto take_r = [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      finest.b[i] = Lanes{static_cast<float>(r[3 * i]), static_cast<float>(r[3 * i + 1]), static_cast<float>(r[3 * i + 2]), 0};
  };
  pool_->for_chunks(finest.blocks, kRowsPerChunk, std::cref(take_r));
  cycle(0);
  const auto give_z = [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      for (int j = 0; j < 3; ++j) z[3 * i + j] = finest.x[i][j];
  };
  pool_->for_chunks(finest.blocks, kRowsPerChunk, std::cref(give_z));
}

}  // namespace crumple::sim::islands
