#include "server/sim/islands/rigid_modes.h"

#include "server/sim/cross_matrix.h"

namespace crumple::sim::islands {

using Eigen::VectorXd;

namespace {

constexpr double kLeastInertia = 1e-8;  // of the mean: pieces whose nodes lie on a line

}  // namespace

void RigidModes::assign(std::span<const ModesPart> parts, std::span<const Mat3> rigid, const linear_solver::LinearMap& multiply) {
  pieces_ = 0;
  body_.clear();
  for (const ModesPart& part : parts) {
    const fem::StepSystem& s = *part.system;
    index_.assign(s.piece_count, 0);  // of the mode; -1: held
    for (int i = 0; i < s.node_count(); ++i)
      if (s.prescribed[i]) index_[s.piece[i]] = -1;
    for (int& i : index_)
      if (i == 0) i = pieces_++;
    for (int i = 0; i < s.node_count(); ++i) body_.push_back(index_[s.piece[i]]);
  }
  soft_blocks_ = static_cast<int>(body_.size());
  own_.assign(pieces_ + rigid.size() / 2, Mat6::Zero());

  centre_.assign(pieces_, Vec3::Zero());
  mass_.assign(pieces_, 0);
  const auto each_node = [&](const auto& visit) {
    for (const ModesPart& part : parts)
      for (int i = 0; i < part.system->node_count(); ++i)
        if (const int p = body_[part.first_block + i]; p >= 0) visit(part, i, p);
  };
  each_node([&](const ModesPart& part, int i, int p) {
    mass_[p] += part.system->row_mass[i];
    centre_[p] += part.system->row_mass[i] * (*part.x)[i];
  });
  for (int p = 0; p < pieces_; ++p) centre_[p] /= mass_[p];
  arm_.assign(soft_blocks_, Vec3::Zero());
  each_node([&](const ModesPart& part, int i, int p) { arm_[part.first_block + i] = (*part.x)[i] - centre_[p]; });

  // Rows of A sum to the mass, so translations need no product, and about the centre of mass turning does not pull.
  for (int p = 0; p < pieces_; ++p) own_[p].topLeftCorner<3, 3>() = mass_[p] * Mat3::Identity();
  turn_.setZero(3 * soft_blocks_ + 3 * static_cast<Eigen::Index>(rigid.size()));
  pull_.resize(turn_.size());
  for (int axis = 0; axis < 3 && pieces_ > 0; ++axis) {
    for (int i = 0; i < soft_blocks_; ++i)
      if (body_[i] >= 0) turn_.segment<3>(3 * i) = Vec3::Unit(axis).cross(arm_[i]);
    multiply(turn_, pull_);
    for (int i = 0; i < soft_blocks_; ++i)
      if (body_[i] >= 0) own_[body_[i]].block<3, 1>(3, 3 + axis) += arm_[i].cross(Vec3(pull_.segment<3>(3 * i)));
  }
  for (int p = 0; p < pieces_; ++p) {
    auto inertia = own_[p].bottomRightCorner<3, 3>();
    inertia = (0.5 * (inertia + inertia.transpose())).eval();
    inertia.diagonal().array() += kLeastInertia * inertia.trace();
  }
  for (std::size_t k = 0; k < rigid.size(); ++k) {
    const int begin = 3 * static_cast<int>(k % 2);
    own_[pieces_ + k / 2].block<3, 3>(begin, begin) = rigid[k];
  }
}

void RigidModes::add_rows(const contact::ContactRows& rows) {
  diagonal_ = own_;
  couplings_.clear();
  for (int row = 0; row < rows.size(); ++row) {
    // A row has two sides, and each of them one piece or rigid body.
    int side[2] = {-1, -1};
    Mat36 W[2] = {Mat36::Zero(), Mat36::Zero()};
    rows.for_entries(row, [&](const contact::ContactRows::Entry& entry) {
      const int body = body_of(entry.block);
      if (body < 0) return;
      const int k = side[0] < 0 || side[0] == body ? 0 : 1;
      side[k] = body;
      if (entry.block < soft_blocks_) {
        W[k].leftCols<3>() += entry.weight * Mat3::Identity();
        W[k].rightCols<3>() -= entry.weight * cross_matrix(arm_[entry.block]);  // w x r = -[r] w
      } else if (entry.weight != 0) {
        W[k].leftCols<3>() += entry.weight * Mat3::Identity();
      } else {
        W[k].rightCols<3>() -= cross_matrix(entry.arm);
      }
    });
    const Mat3& D = rows.coefficients()[row];
    for (int k = 0; k < 2; ++k)
      if (side[k] >= 0) diagonal_[side[k]] += W[k].transpose() * D * W[k];
    if (side[1] < 0 || !is_coupled()) continue;
    const int a = side[0] > side[1] ? 0 : 1, b = 1 - a;
    const Mat6 E = W[a].transpose() * D * W[b];
    // Rows of a pair follow each other.
    if (!couplings_.empty() && couplings_.back().a == side[a] && couplings_.back().b == side[b]) couplings_.back().E += E;
    else couplings_.push_back({side[a], side[b], E});
  }
}

void RigidModes::factor(const contact::ContactRows& rows) {
  add_rows(rows);
  f_.resize(6 * count());
  v_.resize(6 * count());
  if (is_coupled()) {
    E_.setZero(6 * count(), 6 * count());
    for (int k = 0; k < count(); ++k) E_.block<6, 6>(6 * k, 6 * k) = diagonal_[k];
    for (const Coupling& c : couplings_) E_.block<6, 6>(6 * c.a, 6 * c.b) += c.E;
    coupled_.compute(E_);  // the lower triangle
    return;
  }
  inverse_.resize(count());
  for (int k = 0; k < count(); ++k) {
    const Eigen::LLT<Mat6> factor(diagonal_[k]);
    inverse_[k].setZero();
    if (factor.info() == Eigen::Success) inverse_[k] = factor.solve(Mat6::Identity());
    else if (k >= pieces_) inverse_[k].setIdentity();  // as block-Jacobi has it
    inverse_[k] = (0.5 * (inverse_[k] + inverse_[k].transpose())).eval();
  }
}

void RigidModes::add_to(const VectorXd& r, VectorXd& z) {
  if (is_coupled() && coupled_.info() != Eigen::Success) return;
  f_.setZero();
  for (int i = 0; i < soft_blocks_; ++i) {
    if (body_[i] < 0) continue;
    const Vec3 f_i = r.segment<3>(3 * i);
    f_.segment<3>(6 * body_[i]) += f_i;
    f_.segment<3>(6 * body_[i] + 3) += arm_[i].cross(f_i);
  }
  const Eigen::Index rigid = 6 * (count() - pieces_);
  f_.tail(rigid) = r.tail(rigid);
  if (is_coupled()) {
    v_ = f_;
    coupled_.solveInPlace(v_);
  } else {
    for (int k = 0; k < count(); ++k) v_.segment<6>(6 * k).noalias() = inverse_[k] * f_.segment<6>(6 * k);
  }
  for (int i = 0; i < soft_blocks_; ++i) {
    if (body_[i] < 0) continue;
    const auto v_i = v_.segment<6>(6 * body_[i]);
    z.segment<3>(3 * i) += Vec3(v_i.head<3>()) + Vec3(v_i.tail<3>()).cross(arm_[i]);
  }
  z.tail(rigid) = v_.tail(rigid);
}

}  // namespace crumple::sim::islands
