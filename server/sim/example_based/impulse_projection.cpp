#include "server/sim/example_based/impulse_projection.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple::sim::example_based {
namespace {

WeightRow gradient_step(const ExampleParameters& p, const Jacobian& J, const Vec3& dx) {
  const WeightRow Jt_dx = J.transpose() * dx;
  const double norm = Jt_dx.norm();
  const double threshold = p.raw_rates ? kRawOrthogonal : kOrthogonal * J.norm() * dx.norm();
  if (!(norm > threshold)) return WeightRow::Zero(J.cols());
  return (p.alpha * dx.norm() / norm) * Jt_dx;
}

// J^+ dx = J^T (J J^T)^+ dx: three eigenvalues s^2 however many examples there are. Squaring leaves s resolved to about
// 1e-8 s_max, below both thresholds.
WeightRow pseudo_inverse_step(const ExampleParameters& p, const Jacobian& J, const Vec3& dx) {
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.compute(Mat3(J * J.transpose()));
  const Vec3 s2 = eigen.eigenvalues().cwiseMax(0);
  const double s2_max = s2.maxCoeff();
  if (!(s2_max > 0)) return WeightRow::Zero(J.cols());
  Vec3 filter;
  for (int k = 0; k < 3; ++k)
    filter[k] = p.raw_rates ? (s2[k] > kRawThreshold * kRawThreshold * s2_max ? 1 / s2[k] : 0)
                            : 1 / (s2[k] + kTikhonov * kTikhonov * s2_max);
  const Vec3 y = eigen.eigenvectors() * filter.cwiseProduct(eigen.eigenvectors().transpose() * dx);
  return p.alpha * (J.transpose() * y);
}

}  // namespace

double projection_dt(const ExampleParameters& parameters, double dt, double rate_dt) {
  return parameters.raw_rates ? dt : rate_dt;
}

Vec3 plastic_displacement(const Vec3& j, double dt, double m, double beta) {
  assert(m > 0);
  const double norm = j.norm();
  if (!(norm > beta)) return Vec3::Zero();
  return (dt / m * (norm - beta) / norm) * j;
}

WeightRow weight_change(const ExampleParameters& parameters, const Jacobian& J, const Vec3& dx) {
  if (dx.isZero(0)) return WeightRow::Zero(J.cols());
  switch (parameters.step) {
    case ExampleParameters::Step::equation8:
      return gradient_step(parameters, J, dx);
    case ExampleParameters::Step::equation9:
      return pseudo_inverse_step(parameters, J, dx);
    case ExampleParameters::Step::equation10:
      return parameters.alpha * (J.transpose() * dx);
  }
  return WeightRow::Zero(J.cols());
}

}  // namespace crumple::sim::example_based
