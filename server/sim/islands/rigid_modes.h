#pragma once

#include "server/sim/contact/contact_rows.h"
#include "server/sim/fem/assembly.h"
#include "server/sim/linear_solver/conjugate_gradient.h"

#include <Eigen/Cholesky>

#include <span>
#include <vector>

namespace crumple::sim::islands {

// A soft body in an island's system.
struct ModesPart {
  const fem::StepSystem* system = nullptr;
  const std::vector<Vec3>* x = nullptr;  // positions of its nodes [m]
  int first_block = 0;
};

// The coarse part of a two-level preconditioner: z = D^-1 r + P E^-1 P^T r, D the block diagonal, E = P^T (A + W^T D W) P. The
// columns of P are the rigid motions of each connected piece of a soft body that has no prescribed node, and the unknowns of rigid
// bodies, for which D^-1 is left out. Block-Jacobi alone takes as many iterations to move a stiff piece as a whole as it takes
// to carry a wave through it and back; what it is left with beside P is what deforms, and what contact does inside of pieces.
// Up to kMostCoupled pieces and rigid bodies E is whole, so that what rests on each other is solved together. Of more only its
// 6x6 diagonal blocks are kept: a factor of a heap would cost more than the iterations it saves.
class RigidModes {
 public:
  // parts: in the order of their blocks, which they fill without gaps. rigid: two diagonal blocks a rigid body, after the
  // parts'. multiply: by A, the island's matrix without rows; called three times.
  RigidModes(std::span<const ModesPart> parts, std::span<const Mat3> rigid, const linear_solver::LinearMap& multiply) {
    assign(parts, rigid, multiply);
  }
  RigidModes() = default;
  void assign(std::span<const ModesPart> parts, std::span<const Mat3> rigid, const linear_solver::LinearMap& multiply);  // keeps its memory

  static constexpr int kMostCoupled = 24;

  // E with the rows as they stand. What of E is not positive definite is left out.
  void factor(const contact::ContactRows& rows);
  void add_to(const Eigen::VectorXd& r, Eigen::VectorXd& z);  // z is D^-1 r before; 3 a block

  int count() const { return static_cast<int>(own_.size()); }  // pieces and rigid bodies

 private:
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  using Mat36 = Eigen::Matrix<double, 3, 6>;
  struct Coupling {
    int a, b;  // a > b
    Mat6 E;
  };
  int body_of(int block) const { return block < soft_blocks_ ? body_[block] : pieces_ + (block - soft_blocks_) / 2; }
  bool is_coupled() const { return count() <= kMostCoupled; }
  void add_rows(const contact::ContactRows& rows);

  int soft_blocks_ = 0, pieces_ = 0;
  std::vector<int> body_;     // one a soft block: its piece, -1: of one that is held
  std::vector<Vec3> arm_;     // one a soft block, from its piece's centre of mass [m]
  std::vector<Mat6> own_;     // E's diagonal blocks without rows; pieces, then rigid bodies
  std::vector<Mat6> diagonal_;
  std::vector<Coupling> couplings_;
  Eigen::MatrixXd E_;
  Eigen::LLT<Eigen::MatrixXd> coupled_;
  std::vector<Mat6> inverse_;   // of diagonal blocks, where not coupled
  Eigen::VectorXd f_, v_;       // scratch
  std::vector<int> index_;      // and of assign()
  std::vector<Vec3> centre_;
  std::vector<double> mass_;
  Eigen::VectorXd turn_, pull_;
};

}  // namespace crumple::sim::islands
