#pragma once

#include "common/types.h"
#include "server/sim/parallel_for.h"
#include "server/sim/quad.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <array>
#include <span>
#include <vector>

// Contact as rows of the implicit solve. A row sees the relative velocity u of its two sides at a point, side 0 minus
// side 1, and answers with the impulse
//   lambda = n lambda_n + lambda_t,  lambda_n = c_n (target - n.u),  lambda_t = t0 - c_t (I - n n^T) u
// on side 0 and -lambda on side 1. u is linear in the unknowns, so a row adds a symmetric positive semi-definite term
// W^T D W, D = c_t I + (c_n - c_t) n n^T, to the matrix [Parker & O'Brien 2009, section 6: the 64 blocks
// phi b_i b_j r^ r^T]. The blocks are never formed.
namespace crumple::sim::contact {

// One body of a row: up to four free soft nodes, or a movable rigid body, or neither (fixed, prescribed).
struct ContactSide {
  int body = -1;                     // as in detect(); planes follow the bodies
  int tet = -1;                      // of the body's mesh, of a node's row its node; -1: plane
  int node_count = 0;                // free soft nodes
  std::array<int, 4> nodes{};        // of the body
  std::array<double, 4> weights{};   // barycentric, with the side's sign
  bool rigid = false;                // movable rigid body
  Vec3 arm = Vec3::Zero();           // of a movable rigid body: point - centre of mass, both where contact is looked for [m]
};

// Bodies and tets of the two sides.
using RowKey = std::array<int, 4>;

struct ContactRow {
  std::array<ContactSide, 2> sides;
  Vec3 point = Vec3::Zero();           // in W [m]
  Vec3 normal = Vec3::UnitY();         // unit, from side 1 to side 0
  Vec3 known_velocity = Vec3::Zero();  // part of u that is not unknown: prescribed nodes, kinematic bodies [m/s]
  double area = 0;                     // |r|, of two soft bodies times ContactNormal's weight [m^2]
  double depth = 0;                    // at the start of the step [m]; negative: a gap
  double c_n = 0;                      // [N s / (m/s)]
  double target = 0;                   // s*, separation speed sought [m/s]
  double friction = 0;                 // mu of Coulomb's law [-]; 0: none
  double volume = 0;                   // of the overlap where contact is looked for [m^3]
  double weight_speed = 0;             // of friction by weight (weight_friction.h) [m/s]; 0: none
  int pair = 0;                        // which two components, or component and plane; its rows are consecutive. Lasting rows have their own
  bool swept = false;                  // of features that would pass through each other in the step; friction forgets it
  int lasted = 0;                      // steps since it was found (lasting_rows.h)
  double mass = 0;                     // reduced mass of the two bodies times this row's share of the contact [kg]

  // Set between the passes of a solve.
  bool active = true;
  double c_t = 0;             // <= c_n; c_n: the row sticks
  Vec3 t0 = Vec3::Zero();     // tangential impulse given in advance [N s]
  double lambda_n = 0;        // outcome [N s]
  Vec3 lambda_t = Vec3::Zero();

  Vec3 impulse() const { return lambda_n * normal + lambda_t; }  // on side 0, outcome
  RowKey key() const { return {sides[0].body, sides[1].body, sides[0].tet, sides[1].tet}; }
};

// The rows of one linear system. Unknowns are blocks of three: a node's velocity; for a rigid body its linear velocity
// and, in the next block, its angular velocity (both in W).
class ContactRows {
 public:
  ContactRows() = default;
  // rows: borrowed, must outlive this object; their number and sides must not change. first_block: by body, its first
  // block; only bodies with unknowns are read. block_count: of the system.
  ContactRows(std::span<ContactRow> rows, std::span<const int> first_block, int block_count) {
    assign(rows, first_block, block_count);
    refresh(ThreadPool(1));
  }
  void assign(std::span<ContactRow> rows, std::span<const int> first_block, int block_count);  // keeps its memory; refresh() is to follow

  // After a change of the rows' active, c_n, c_t, t0 or target.
  void refresh(const ThreadPool& pool);

  // y += W^T D W x over the active rows; x, y: 3 a block. Or in two strokes, so that others may add to y in the loop of the second:
  // the rows' forces D W x, then of blocks [begin, end) what they sum to.
  void apply_add(const Eigen::VectorXd& x, Eigen::VectorXd& y, const ThreadPool& pool) const;
  void find_forces(const Eigen::VectorXd& x, const ThreadPool& pool) const;
  void add_forces(int begin, int end, Eigen::VectorXd& y) const;
  // blocks[b] += the 3x3 diagonal blocks of W^T D W.
  void add_to_diagonal(std::span<Mat3> blocks, const ThreadPool& pool) const;
  // The blocks of W^T D W, all of them; for a direct solver.
  void append_to(std::vector<Eigen::Triplet<double>>& entries) const;
  // b += W^T (n c_n target + t0 - D known_velocity).
  void add_to_rhs(Eigen::VectorXd& b, const ThreadPool& pool) const;

  // u of row k, known part included [m/s].
  Vec3 relative_velocity(int k, const Eigen::VectorXd& x) const;
  int size() const { return static_cast<int>(rows_.size()); }

  // One coefficient of W: u += weight x_block, or u += x_block x arm for an angular velocity (weight 0).
  struct Entry {
    int row, block;
    double weight;
    Vec3 arm;
  };
  // Calls see(entry) for those of a row.
  template <class See>
  void for_entries(int row, See see) const {
    for (int e = of_row_.weighted_start[row]; e < of_row_.weighted_start[row + 1]; ++e)
      see(Entry{row, of_row_.weighted[e].other, of_row_.weighted[e].weight, Vec3::Zero()});
    for (int e = of_row_.turned_start[row]; e < of_row_.turned_start[row + 1]; ++e)
      see(Entry{row, of_row_.turned[e].other, 0, of_row_.turned[e].arm});
  }
  const std::vector<Mat3>& coefficients() const { return D_; }  // D of each row, zero where inactive

 private:
  // The entries of rows, or of blocks, as a product reads them: those with a weight apart from those with an arm.
  struct Lists {
    struct Weighted {
      int other;  // block of a row's entry, row of a block's
      double weight;
    };
    struct Turned {
      int other;
      Vec3 arm;
    };
    std::vector<int> weighted_start, turned_start;  // one more than there are lists
    std::vector<Weighted> weighted;
    std::vector<Turned> turned;

    void clear(int entries, int lists);  // of which there will be about so many
    void close();                        // the next entry is of the next list
  };

  void push_side(const ContactSide& side, double sign, std::span<const int> first_block);
  void list_by_block(int block_count);
  void scatter(Eigen::VectorXd& y, const ThreadPool& pool) const;  // y += W^T f
  Quad gather(int k, const Eigen::VectorXd& x) const;  // W x of row k

  std::span<ContactRow> rows_;
  Lists of_row_, of_block_;         // blocks: those of touched_; entries by row: sums never race, and keep their order
  std::vector<int> touched_;        // ascending
  std::vector<Mat3> D_;             // zero where inactive
  std::vector<std::array<int, 2>> next_;  // scratch of list_by_block()
  mutable std::vector<Eigen::Vector4d> f_;  // scratch, one a row; the fourth number is of no use
};

}  // namespace crumple::sim::contact
