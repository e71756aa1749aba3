#include "server/sim/example_based/simplex_tangent.h"

#include <Eigen/Eigenvalues>

#include <algorithm>

namespace crumple::sim::example_based {
namespace {

constexpr double kResolved = 1e-7;  // of the largest singular value: squaring leaves no more

}  // namespace

SimplexTangent::SimplexTangent(const Jacobian& J, const ExampleList& examples, double slack)
    : all_(static_cast<int>(J.cols())), examples_(examples), C_(3, examples.size()) {
  for (int k = 0; k < examples_.size(); ++k) C_.col(k) = J.col(examples_[k]);
  const Vec3 mean = C_.rowwise().mean();
  C_.colwise() -= mean;
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(Mat3(C_ * C_.transpose()));
  const Vec3 s2 = eigen.eigenvalues().cwiseMax(0);
  const double floor = std::max(slack, kResolved * std::sqrt(s2.maxCoeff()));
  Vec3 filter;
  for (int k = 0; k < 3; ++k) filter[k] = s2[k] > floor * floor ? 1 / s2[k] : 0;
  inverse_ = eigen.eigenvectors() * filter.asDiagonal() * eigen.eigenvectors().transpose();
}

WeightRow SimplexTangent::spread(const Eigen::Ref<const WeightRow>& d) const {
  WeightRow all = WeightRow::Zero(all_);
  for (int k = 0; k < examples_.size(); ++k) all[examples_[k]] = d[k];
  return all;
}

WeightRow SimplexTangent::still_part(const WeightRow& v) const {
  WeightRow d = WeightRow::Zero(examples_.size());
  for (int k = 0; k < examples_.size(); ++k) d[k] = v[examples_[k]];
  d.array() -= d.mean();
  const Vec3 moved = inverse_ * (C_ * d);
  d -= C_.transpose() * moved;
  return spread(d);
}

WeightRow SimplexTangent::reaching(const Vec3& r) const {
  const Vec3 y = inverse_ * r;
  return spread(C_.transpose() * y);
}

}  // namespace crumple::sim::example_based
