#include "server/authoring/k_means.h"

#include <algorithm>
#include <cassert>

namespace crumple::authoring {
namespace {

Eigen::MatrixXd farthest_points(const Eigen::MatrixXd& points, int count) {
  constexpr double kSame = 1e-14;  // squared distance: rounding of what follows
  Eigen::MatrixXd centres(points.rows(), count);
  const Eigen::VectorXd norms = points.colwise().squaredNorm().transpose();
  const Eigen::VectorXd mean = points.rowwise().mean();
  Eigen::VectorXd distance = (points.colwise() - mean).colwise().squaredNorm().transpose();
  for (int k = 0; k < count; ++k) {
    Eigen::Index farthest = 0;
    const double most = distance.maxCoeff(&farthest);
    if (k > 0 && !(most > kSame)) return centres.leftCols(k);  // fewer different points than asked for
    centres.col(k) = points.col(farthest);
    const Eigen::VectorXd to_new =
        (norms - 2 * (points.transpose() * centres.col(k))).array() + centres.col(k).squaredNorm();
    distance = k == 0 ? to_new : Eigen::VectorXd(distance.cwiseMin(to_new));
  }
  return centres;
}

// Nearest centre of each point; blocks of points, so that distances are a product of small matrices. Whether any
// changed.
bool assign(const Eigen::MatrixXd& points, const Eigen::MatrixXd& centres, std::vector<int>& of) {
  constexpr Eigen::Index kBlock = 512;
  const Eigen::VectorXd half_norms = 0.5 * centres.colwise().squaredNorm().transpose();
  bool changed = false;
  for (Eigen::Index begin = 0; begin < points.cols(); begin += kBlock) {
    const Eigen::Index size = std::min(kBlock, points.cols() - begin);
    const Eigen::MatrixXd nearness = (centres.transpose() * points.middleCols(begin, size)).colwise() - half_norms;
    for (Eigen::Index i = 0; i < size; ++i) {
      Eigen::Index best = 0;
      nearness.col(i).maxCoeff(&best);
      changed = changed || of[begin + i] != best;
      of[begin + i] = static_cast<int>(best);
    }
  }
  return changed;
}

}  // namespace

Clusters k_means(const Eigen::MatrixXd& points, int count, int rounds) {
  assert(points.cols() > 0 && count > 0);
  Eigen::MatrixXd centres = farthest_points(points, static_cast<int>(std::min<Eigen::Index>(count, points.cols())));
  Clusters out;
  out.of.assign(points.cols(), -1);
  for (int round = 0; assign(points, centres, out.of) && round < rounds; ++round) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(centres.rows(), centres.cols());
    Eigen::VectorXd members = Eigen::VectorXd::Zero(centres.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      sums.col(out.of[i]) += points.col(i);
      members[out.of[i]] += 1;
    }
    for (Eigen::Index k = 0; k < centres.cols(); ++k)
      if (members[k] > 0) centres.col(k) = sums.col(k) / members[k];
  }
  std::vector<int> number(centres.cols(), -1);
  for (int& k : out.of) {
    if (number[k] < 0) number[k] = out.count++;
    k = number[k];
  }
  return out;
}

}  // namespace crumple::authoring
