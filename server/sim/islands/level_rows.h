#pragma once

#include "server/sim/contact/contact_rows.h"
#include "server/sim/linear_solver/lanes.h"

#include <functional>
#include <span>
#include <vector>

namespace crumple::sim::islands {

using linear_solver::LaneBlock;
using linear_solver::Lanes;

// Contact rows as one level of a multigrid cycle sees them, in single precision: the same relative velocities, with the
// unknowns of that level in place of nodes and rigid bodies. Never formed into a matrix.
class LevelRows {
 public:
  struct Entry {
    int row, block;
    float weight;  // u += weight x_block; 0: u += x_block x arm, an angular velocity
    Lanes arm;
  };
  using Follow = std::function<void(const Entry&, std::vector<Entry>&)>;  // appends what an entry becomes a level below

  LevelRows() = default;
  explicit LevelRows(const contact::ContactRows& rows) { assign(rows); }
  void assign(const contact::ContactRows& rows);                     // of level 0
  void assign_coarser(const LevelRows& fine, const Follow& follow);  // of one level below; both keep their memory

  bool empty() const { return D_.empty(); }
  // f = D W x; before scatter().
  void product(const Lanes* x, const ThreadPool& pool);
  // W^T f at a block, for blocks asked in ascending order from `from` on: keep the cursor.
  int cursor(int block) const;
  Lanes scatter(int block, int& cursor) const;

  // A block diagonal L with W^T D W <= L: each row's term is bounded by the shares of its blocks (Cauchy-Schwarz).
  void add_bound(double scale, std::span<Mat3> diagonal) const;
  void add_to_dense(Eigen::MatrixXd& A) const;  // A += W^T D W

 private:
  void index();
  Mat3 coefficient(const Entry& e) const;

  std::vector<int> row_start_;
  std::vector<Entry> entries_;             // by row
  std::vector<int> touched_, touch_start_; // blocks with entries, ascending; theirs in by_block_
  std::vector<int> by_block_;              // entries, by block, then by row
  std::vector<Mat3> D_;                    // one a row; zero: inactive
  std::vector<LaneBlock> lane_D_;
  std::vector<Lanes> f_;
  std::vector<int> start_;                 // scratch of index()
  std::vector<Entry> becomes_;             // and of assign_coarser()
};

}  // namespace crumple::sim::islands
