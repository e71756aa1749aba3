#pragma once

#include "server/sim/example_based/skinning.h"

#include <Eigen/Core>

namespace crumple::sim::example_based {

// The examples of a row that may change, in ascending order.
using ExampleList = Eigen::Matrix<int, Eigen::Dynamic, 1, 0, kMaxExamples, 1>;

// Changes d of one vertex's example weights that leave their sum as it is: sum_e d_e = 0, d_e = 0 but for `examples`. Seen by
// what they do to the vertex, J d: with the columns of J taken from their mean (C), J d = C d, and C C^T = U diag(s^2) U^T has
// three eigenvalues however many examples there are.
class SimplexTangent {
 public:
  // J: 3 x E [m]. slack: a change of length 1 that moves the vertex by no more than this counts as moving it not at all [m].
  SimplexTangent(const Jacobian& J, const ExampleList& examples, double slack);

  // The part of v that does not move the vertex: the orthogonal projection onto {d : sum d = 0, C d = 0}. E entries.
  WeightRow still_part(const WeightRow& v) const;
  // The least d with C d = r, as far as the examples reach [-]. r: [m].
  WeightRow reaching(const Vec3& r) const;

 private:
  WeightRow spread(const Eigen::Ref<const WeightRow>& d) const;  // of `examples` to all E

  int all_;
  ExampleList examples_;
  Jacobian C_;       // 3 x |examples|
  Mat3 inverse_;     // (C C^T)^+ [1/m^2]
};

}  // namespace crumple::sim::example_based
