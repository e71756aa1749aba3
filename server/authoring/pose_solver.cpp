#include "server/authoring/pose_solver.h"

#include "common/text.h"
#include "server/authoring/k_means.h"
#include "server/authoring/tet_laplacian.h"
#include "server/sim/fem/rotation.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace crumple::authoring {
namespace {

using sim::example_based::BoneTransform;
using sim::fem::svd_rotation;
using Transforms = Eigen::MatrixX3d;  // 4B x 3: of each handle R^T, then where its point goes
using Sparse = Eigen::SparseMatrix<double>;

Sparse skinning_matrix(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, const std::vector<Vec3>& points) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int b = 0; b < W.cols(); ++b)
    for (int i = 0; i < W.rows(); ++i) {
      if (W(i, b) == 0) continue;
      const Vec3 Y = W(i, b) * (mesh.X[i] - points[b]);
      for (int a = 0; a < 3; ++a) entries.emplace_back(i, 4 * b + a, Y[a]);
      entries.emplace_back(i, 4 * b + 3, W(i, b));
    }
  Sparse M(W.rows(), 4 * W.cols());
  M.setFromTriplets(entries.begin(), entries.end());
  return M;
}

Clusters rotation_groups(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, int count) {
  Eigen::MatrixXd of_tet(W.cols(), mesh.tet_count());
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Tet& tet = mesh.tets[t];
    of_tet.col(t) = (W.row(tet[0]) + W.row(tet[1]) + W.row(tet[2]) + W.row(tet[3])).transpose() / 4;
  }
  return k_means(of_tet, count);
}

Result<void> check(const PoseSolverOptions& o) {
  if (o.rotation_groups < 0 || o.rotation_groups > 4096)
    return invalid("rotation_groups", text("is ", o.rotation_groups, ", must be in [0, 4096]"));
  if (!(o.tolerance > 0 && o.tolerance <= 0.1))
    return invalid("tolerance", text("is ", o.tolerance, ", must be in (0, 0.1]"));
  if (o.max_sweeps < 1 || o.max_sweeps > 1000000)
    return invalid("max_sweeps", text("is ", o.max_sweeps, ", must be in [1, 1000000]"));
  return {};
}

Result<void> check(std::span<const HandleTarget> targets, int handles, const std::string& field) {
  if (static_cast<int>(targets.size()) != handles)
    return invalid(field, text("holds ", targets.size(), " targets, must hold ", handles, ", one a handle"));
  for (int b = 0; b < handles; ++b) {
    const HandleTarget& target = targets[b];
    if (target.position && !target.position->allFinite())
      return invalid(text(field, "[", b, "].position"), "is not finite");
    if (target.rotation && !(target.rotation->norm() > 1e-6 && target.rotation->coeffs().allFinite()))
      return invalid(text(field, "[", b, "].rotation"), "must be finite and longer than 1e-6");
  }
  return {};
}

// The rigid motion nearest to what the targets ask; turned no further than they ask for.
struct RigidMotion {
  Mat3 R = Mat3::Identity();
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  // x = R (u - from) + to
};

RigidMotion nearest_rigid_motion(const std::vector<Vec3>& points, std::span<const HandleTarget> targets) {
  RigidMotion out;
  int placed = 0;
  double size2 = 0;
  for (size_t b = 0; b < points.size(); ++b)
    if (targets[b].position) {
      out.from += points[b];
      out.to += *targets[b].position;
      ++placed;
    }
  if (placed > 0) out.from /= placed, out.to /= placed;
  Mat3 H = Mat3::Zero();
  for (size_t b = 0; b < points.size(); ++b) size2 = std::max(size2, (points[b] - out.from).squaredNorm());
  if (size2 == 0) size2 = 1;
  for (size_t b = 0; b < points.size(); ++b) {
    if (targets[b].position) H += (*targets[b].position - out.to) * (points[b] - out.from).transpose();
    if (targets[b].rotation) H += size2 * targets[b].rotation->normalized().toRotationMatrix();
  }
  out.R = svd_rotation(H + 1e-9 * size2 * Mat3::Identity());  // where the targets leave a turn open: none
  return out;
}

}  // namespace

std::vector<HandleTarget> targets_of(std::span<const std::optional<BoneTransform>> pose, std::span<const Vec3> points) {
  assert(pose.size() == points.size());
  std::vector<HandleTarget> out(pose.size());
  for (size_t b = 0; b < pose.size(); ++b)
    if (pose[b]) out[b] = {pose[b]->q.normalized() * points[b] + pose[b]->t, pose[b]->q};
  return out;
}

Result<PoseSolver> PoseSolver::make(const sim::TetMesh& mesh, const Eigen::MatrixXd& W, std::span<const Vec3> points,
                                    const PoseSolverOptions& options) {
  if (auto ok = check(options); !ok) return std::unexpected(ok.error());
  if (auto ok = sim::validate(mesh, "mesh"); !ok) return std::unexpected(ok.error());
  assert(W.rows() == mesh.node_count());
  const int B = static_cast<int>(W.cols());
  if (static_cast<int>(points.size()) != B)
    return invalid("points", text("holds ", points.size(), " points, must hold ", B, ", one a handle"));
  for (int b = 0; b < B; ++b)
    if (!points[b].allFinite()) return invalid(text("points[", b, "]"), "is not finite");

  PoseSolver out;
  out.options_ = options;
  out.points_.assign(points.begin(), points.end());
  const int wanted = options.rotation_groups > 0 ? options.rotation_groups : std::clamp(4 * B, 16, 256);
  const Clusters groups = rotation_groups(mesh, W, wanted);
  std::vector<Eigen::Triplet<double>> entries;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const sim::fem::RestTet rest = laplacian_tet(mesh, t);
    const double V = rest.fill * rest.volume;
    out.volume_ += V;
    out.constant_ += 0.5 * V * rest.rest_gradient.squaredNorm();
    for (int k = 0; k < 4; ++k) {
      const Vec3 g = rest.rest_gradient * rest.normals.col(k) * (-rest.fill / 3);  // n_k = -3 V grad N_k
      for (int a = 0; a < 3; ++a) entries.emplace_back(mesh.tets[t][k], 3 * groups.of[t] + a, g[a]);
    }
  }
  Sparse G(mesh.node_count(), 3 * groups.count);
  G.setFromTriplets(entries.begin(), entries.end());
  const Sparse M = skinning_matrix(mesh, W, out.points_), M_T = M.transpose();
  const Sparse LM = tet_laplacian(mesh).L * M;
  out.A_ = Eigen::MatrixXd(Sparse(M_T * LM));
  out.A_ = 0.5 * (out.A_ + out.A_.transpose().eval());
  out.K_ = Eigen::MatrixXd(Sparse(M_T * G));
  return out;
}

// One pose: what is held, what is free.
class PoseSolver::Problem {
 public:
  Problem(const PoseSolver& solver, std::span<const HandleTarget> targets)
      : s_(solver), B_(solver.handle_count()), targets_(targets) {
    for (int b = 0; b < B_; ++b) {
      if (!targets[b].rotation)
        for (int a = 0; a < 3; ++a) affine_.push_back(4 * b + a);
      if (targets[b].position) continue;
      affine_.push_back(4 * b + 3);
      places_.push_back(4 * b + 3);
    }
    std::ranges::sort(affine_);
    ridge_ = ridge();
  }

  // Every handle by one rigid motion, and what is held as it is asked for. Places are relative to `origin`.
  Transforms start(const RigidMotion& motion, const Vec3& origin) const {
    Transforms T(4 * B_, 3);
    for (int b = 0; b < B_; ++b) {
      const HandleTarget& target = targets_[b];
      T.middleRows<3>(4 * b) =
          (target.rotation ? target.rotation->normalized().toRotationMatrix() : motion.R).transpose();
      const Vec3 place =
          target.position ? *target.position : Vec3(motion.R * (s_.points_[b] - motion.from) + motion.to);
      T.row(4 * b + 3) = (place - origin).transpose();
    }
    return T;
  }

  // P = sum_g K_g R_g^T for the best R_g, so that E = 1/2 T : A T - T : P + constant.
  Transforms best_rotations(const Transforms& T) const {
    Transforms P = Transforms::Zero(4 * B_, 3);
    const Eigen::Matrix3Xd S = T.transpose() * s_.K_;
    for (int g = 0; g < s_.group_count(); ++g)
      P.noalias() += s_.K_.middleCols<3>(3 * g) * svd_rotation(S.middleCols<3>(3 * g)).transpose();
    return P;
  }
  double energy(const Transforms& T, const Transforms& P) const {
    return 0.5 * T.cwiseProduct(s_.A_ * T).sum() - T.cwiseProduct(P).sum() + s_.constant_;
  }

  void solve_affine(Transforms& T, const Transforms& P) { solve(affine_, affine_factor_, T, P); }
  void solve_places(Transforms& T, const Transforms& P) { solve(places_, places_factor_, T, P); }

  // The rotation next to each affine part.
  void make_rigid(Transforms& T) const {
    for (int b = 0; b < B_; ++b) T.middleRows<3>(4 * b) = svd_rotation(T.middleRows<3>(4 * b).transpose()).transpose();
  }

  void turn_handles(Transforms& T, const Transforms& P) const {
    const double least = 1e-12 * s_.A_.trace() / B_;
    for (int b = 0; b < B_; ++b) {
      const Mat3 own = s_.A_.block<3, 3>(4 * b, 4 * b);
      if (targets_[b].rotation || !(own.trace() > least)) continue;
      const Mat3 C = P.middleRows<3>(4 * b) - s_.A_.middleRows<3>(4 * b) * T + own * T.middleRows<3>(4 * b);
      T.middleRows<3>(4 * b) = svd_rotation(C.transpose()).transpose();
    }
  }

 private:
  using Factor = Eigen::LDLT<Eigen::MatrixXd>;

  // Where A is singular (handles that act alike, or on nothing) a solve takes the answer near to what was before.
  Eigen::VectorXd ridge() const {
    Eigen::VectorXd out(4 * B_);
    for (int row = 0; row < 4 * B_; ++row) {
      double mean = 0;  // of its kind: turns [m^3], places [m]
      for (int b = 0; b < B_; ++b)
        mean += row % 4 == 3 ? s_.A_(4 * b + 3, 4 * b + 3) : s_.A_.block<3, 3>(4 * b, 4 * b).trace() / 3;
      out[row] = mean > 0 ? 1e-9 * s_.A_(row, row) + 1e-12 * mean / B_ : 1;
    }
    return out;
  }

  void solve(const std::vector<int>& free, std::optional<Factor>& factor, Transforms& T, const Transforms& P) const {
    if (free.empty()) return;
    if (!factor) {
      Eigen::MatrixXd A = s_.A_(free, free);
      A.diagonal() += ridge_(free);
      factor.emplace(A);
    }
    const Transforms downhill = P - s_.A_ * T;
    T(free, Eigen::all) += factor->solve(downhill(free, Eigen::all));
  }

  const PoseSolver& s_;
  int B_;
  std::span<const HandleTarget> targets_;
  std::vector<int> affine_, places_;  // rows of T that are free
  Eigen::VectorXd ridge_;
  std::optional<Factor> affine_factor_, places_factor_;
};

Result<SolvedPose> PoseSolver::solve(std::span<const HandleTarget> targets, const std::string& field) const {
  constexpr int kAffineRounds = 100;
  constexpr double kAffineEnough = 1e-6;
  if (auto ok = check(targets, handle_count(), field); !ok) return std::unexpected(ok.error());
  const RigidMotion motion = nearest_rigid_motion(points_, targets);
  Problem problem(*this, targets);
  SolvedPose out;
  PoseSolveReport& report = out.report;
  const double rounding = 1e-12 * volume_;  // a strain of 1e-6

  Transforms T = problem.start(motion, motion.to), affine = T;
  Transforms P = problem.best_rotations(T);
  double before = problem.energy(T, P);
  for (bool more = before > rounding; more && report.affine_rounds < kAffineRounds; ++report.affine_rounds) {
    problem.solve_affine(affine, problem.best_rotations(affine));
    const double after = problem.energy(affine, problem.best_rotations(affine));
    more = before - after > kAffineEnough * after;
    before = after;
  }
  if (report.affine_rounds > 0) {
    problem.solve_places(T, P);
    problem.make_rigid(affine);
    problem.solve_places(affine, problem.best_rotations(affine));
    if (problem.energy(affine, problem.best_rotations(affine)) < problem.energy(T, problem.best_rotations(T)))
      T = affine;
    P = problem.best_rotations(T);
  }
  report.energies.push_back(problem.energy(T, P));
  report.converged = report.energies.back() <= rounding;
  while (report.sweeps < options_.max_sweeps && !report.converged) {
    Transforms next = T;
    problem.turn_handles(next, P);
    problem.solve_places(next, P);
    const Transforms next_P = problem.best_rotations(next);
    const double after = problem.energy(next, next_P), gained = report.energies.back() - after;
    report.converged = !(gained > options_.tolerance * after) || gained <= rounding;
    if (!(gained > 0)) break;  // at rounding
    T = std::move(next);
    P = next_P;
    report.energies.push_back(after);
    ++report.sweeps;
  }
  report.strain = std::sqrt(std::max(0.0, 2 * report.energies.back() / volume_));
  for (int b = 0; b < handle_count(); ++b) {
    const Quat q(Mat3(T.middleRows<3>(4 * b).transpose()));
    const Vec3 place = targets[b].position.value_or(T.row(4 * b + 3).transpose() + motion.to);
    out.bones.push_back({q.normalized(), place - q.normalized() * points_[b]});
  }
  return out;
}

}  // namespace crumple::authoring
