#include "server/authoring/pose_from_shape.h"

#include "common/text.h"
#include "server/sim/cross_matrix.h"
#include "server/sim/fem/rotation.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple::authoring {
namespace {

using Motions = std::vector<HandleMotion>;

// The least-squares problem of one shape.
class ShapeFit {
 public:
  ShapeFit(const EmbeddedSkinning& skin, std::span<const Vec3> target, double turn_penalty)
      : skin_(skin), target_(target), B_(skin.handle_count()), w2_(B_, 0.0), mu_(B_, 0.0) {
    gram_ = Eigen::MatrixXd::Zero(4 * B_, 4 * B_);
    std::vector<Eigen::Vector4d> h;
    for (int v = 0; v < skin.point_count(); ++v) {
      const auto terms = skin.terms(v);
      h.clear();
      for (const auto& term : terms) h.emplace_back(term.Y.x(), term.Y.y(), term.Y.z(), term.w);
      for (size_t k = 0; k < terms.size(); ++k)
        for (size_t j = 0; j <= k; ++j)  // handles ascend: the lower triangle
          gram_.block<4, 4>(4 * terms[k].handle, 4 * terms[j].handle) += h[k] * h[j].transpose();
    }
    Eigen::MatrixXd A(B_, B_);
    for (int k = 0; k < B_; ++k)
      for (int j = 0; j <= k; ++j) A(k, j) = A(j, k) = gram_(4 * k + 3, 4 * j + 3);
    for (int b = 0; b < B_; ++b) {
      w2_[b] = A(b, b);
      mu_[b] = turn_penalty * gram_.block<3, 3>(4 * b, 4 * b).trace();
    }
    A.diagonal().array() += 1e-9 * A.trace() / B_;  // a step towards the optimum where A is singular
    translations_.compute(A);
  }

  // What is left over, target - skinned, at every vertex.
  std::vector<Vec3> residuals(const Motions& m) const {
    std::vector<Vec3> r(target_.begin(), target_.end());
    for (size_t v = 0; v < r.size(); ++v) r[v] -= skin_.position(static_cast<int>(v), m);
    return r;
  }

  double energy(const Motions& m) const {
    double sum = 0;
    for (const Vec3& r : residuals(m)) sum += r.squaredNorm();
    for (int b = 0; b < B_; ++b) sum += mu_[b] * (m[b].R - Mat3::Identity()).squaredNorm();
    return sum;
  }

  void solve_translations(Motions& m) const {
    Eigen::MatrixX3d rhs = Eigen::MatrixX3d::Zero(B_, 3);
    const auto r = residuals(m);
    for (int v = 0; v < skin_.point_count(); ++v)
      for (const auto& term : skin_.terms(v)) rhs.row(term.handle) += term.w * r[v].transpose();
    const Eigen::MatrixX3d change = translations_.solve(rhs);
    for (int b = 0; b < B_; ++b) m[b].s += change.row(b).transpose();
  }

  // Every handle in turn takes its best motion, the others fixed.
  void sweep(Motions& m) const {
    auto r = residuals(m);
    std::vector<std::vector<std::pair<int, const EmbeddedSkinning::Term*>>> of(B_);
    for (int v = 0; v < skin_.point_count(); ++v)
      for (const auto& term : skin_.terms(v)) of[term.handle].emplace_back(v, &term);
    for (int b = 0; b < B_; ++b) {
      if (!(w2_[b] > 0)) continue;
      const HandleMotion before = m[b];
      Mat3 H = mu_[b] * Mat3::Identity();
      Vec3 s = Vec3::Zero();
      for (const auto& [v, term] : of[b]) {
        const Vec3 wanted = r[v] + before.R * term->Y + term->w * before.s;
        H += wanted * term->Y.transpose();
        s += term->w * wanted;
      }
      m[b] = {sim::fem::svd_rotation(H), s / w2_[b]};
      for (const auto& [v, term] : of[b]) r[v] -= (m[b].R - before.R) * term->Y + term->w * (m[b].s - before.s);
    }
    solve_translations(m);
  }

  // J^T J (its lower triangle) and J^T r of the residuals for small turns (in front of R_b) and shifts: 6 unknowns a
  // handle, J_vb = (-[R_b Y_vb]x, w_vb I). Products over all vertices are those of (Y, w), turned: the same for any R.
  void linearise(const Motions& m, Eigen::MatrixXd& A, Eigen::VectorXd& g) const {
    A.setZero(6 * B_, 6 * B_);
    g.setZero(6 * B_);
    for (int k = 0; k < B_; ++k)
      for (int j = 0; j <= k; ++j) {
        const Eigen::Matrix4d h = gram_.block<4, 4>(4 * k, 4 * j);
        const Mat3 yy = m[k].R * h.topLeftCorner<3, 3>() * m[j].R.transpose();  // sum of y_k y_j^T
        const Vec3 yw = m[k].R * h.topRightCorner<3, 1>(), wy = m[j].R * h.bottomLeftCorner<1, 3>().transpose();
        A.block<3, 3>(6 * k, 6 * j) = yy.trace() * Mat3::Identity() - yy.transpose();
        A.block<3, 3>(6 * k, 6 * j + 3) = sim::cross_matrix(yw);
        A.block<3, 3>(6 * k + 3, 6 * j) = -sim::cross_matrix(wy);
        A.block<3, 3>(6 * k + 3, 6 * j + 3) = h(3, 3) * Mat3::Identity();
      }
    const auto r = residuals(m);
    for (int v = 0; v < skin_.point_count(); ++v)
      for (const auto& term : skin_.terms(v)) {
        g.segment<3>(6 * term.handle) += (m[term.handle].R * term.Y).cross(r[v]);
        g.segment<3>(6 * term.handle + 3) += term.w * r[v];
      }
    for (int b = 0; b < B_; ++b) {  // of mu |R - I|^2 = 2 mu (3 - tr R)
      const Mat3 skew = m[b].R - m[b].R.transpose();
      A.block<3, 3>(6 * b, 6 * b).diagonal().array() += 2 * mu_[b];
      g.segment<3>(6 * b) -= mu_[b] * Vec3(skew(2, 1), skew(0, 2), skew(1, 0));
    }
  }

  Motions moved(const Motions& m, const Eigen::VectorXd& step) const {
    Motions out = m;
    for (int b = 0; b < B_; ++b) {
      const Vec3 turn = step.segment<3>(6 * b);
      if (const double angle = turn.norm(); angle > 0)
        out[b].R = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * m[b].R;
      out[b].s += step.segment<3>(6 * b + 3);
    }
    return out;
  }

 private:
  const EmbeddedSkinning& skin_;
  std::span<const Vec3> target_;
  int B_;
  std::vector<double> w2_, mu_;
  Eigen::MatrixXd gram_;  // 4B x 4B, lower blocks: sum over vertices of (Y, w)_k (Y, w)_j^T
  Eigen::LDLT<Eigen::MatrixXd> translations_;
};

Motions fit(const ShapeFit& problem, Motions m, PoseResidual& report) {
  constexpr int kSweeps = 10, kMostSteps = 60;
  constexpr double kEnough = 1e-12;
  problem.solve_translations(m);
  double energy = problem.energy(m);
  for (; report.sweeps < kSweeps; ++report.sweeps) {
    Motions next = m;
    problem.sweep(next);
    const double after = problem.energy(next);
    if (!(after < energy)) break;  // at rounding
    m = std::move(next);
    energy = after;
  }
  Eigen::MatrixXd A;
  Eigen::VectorXd g;
  double damping = 1e-3;
  bool fresh = true;
  for (int tries = 0; tries < kMostSteps && !report.converged; ++tries) {
    if (fresh) problem.linearise(m, A, g);
    Eigen::MatrixXd damped = A;
    damped.diagonal() += damping * A.diagonal();
    damped.diagonal().array() += 1e-12 * A.trace() / static_cast<double>(A.rows());
    Motions next = problem.moved(m, damped.selfadjointView<Eigen::Lower>().ldlt().solve(g));
    const double after = problem.energy(next);
    fresh = after < energy;
    if (fresh) {
      report.converged = energy - after <= kEnough * energy;
      m = std::move(next);
      energy = after;
      damping = std::max(damping / 10, 1e-12);
      ++report.steps;
    } else {
      damping *= 10;
      report.converged = damping > 1e8 || energy == 0;  // no direction goes down
    }
  }
  return m;
}

void measure(const std::vector<Vec3>& r, std::span<const Vec3> rest, std::span<const Vec3> target, PoseResidual& out) {
  for (size_t v = 0; v < r.size(); ++v) {
    const double moved = (target[v] - rest[v]).norm();
    out.rms += r[v].squaredNorm();
    out.displacement_rms += moved * moved;
    out.displacement_max = std::max(out.displacement_max, moved);
    if (r[v].norm() > out.max) {
      out.max = r[v].norm();
      out.worst_vertex = static_cast<int>(v);
    }
  }
  out.rms = std::sqrt(out.rms / static_cast<double>(r.size()));
  out.displacement_rms = std::sqrt(out.displacement_rms / static_cast<double>(r.size()));
}

Result<void> check_shape(const DeformedShape& shape, size_t vertices, const std::string& field) {
  if (shape.vertices.size() != vertices)
    return invalid(field + ".vertices",
                   text("holds ", shape.vertices.size(), " vertices, must hold ", vertices, " as the surface at rest"));
  for (size_t v = 0; v < vertices; ++v)
    if (!shape.vertices[v].allFinite()) return invalid(text(field, ".vertices[", v, "]"), "is not finite");
  return {};
}

}  // namespace

Result<FittedPose> pose_from_shape(const EmbeddedSkinning& skinning, std::span<const Vec3> rest,
                                   const DeformedShape& shape, const std::string& field, double turn_penalty) {
  assert(static_cast<int>(rest.size()) == skinning.point_count());
  if (auto ok = check_shape(shape, rest.size(), field); !ok) return std::unexpected(ok.error());
  FittedPose out;
  const ShapeFit problem(skinning, shape.vertices, turn_penalty);
  const Motions motions = fit(problem, skinning.rest(), out.residual);
  out.left_over = problem.residuals(motions);
  measure(out.left_over, rest, shape.vertices, out.residual);
  out.example.name = shape.name;
  for (int b = 0; b < skinning.handle_count(); ++b)
    out.example.bones.push_back({Quat(motions[b].R), motions[b].s - motions[b].R * skinning.pivot(b)});
  return out;
}

}  // namespace crumple::authoring
