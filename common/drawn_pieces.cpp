#include "common/drawn_pieces.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include <cassert>
#include <numeric>

namespace crumple {
namespace {

// Lowest vertex of the chain that each vertex is of.
std::vector<int> lowest_of_chain(const BodyTopology& body) {
  std::vector<int> lower(body.vertices.size());
  std::iota(lower.begin(), lower.end(), 0);
  const auto lowest = [&](int v) {
    while (lower[v] != v) v = lower[v] = lower[lower[v]];
    return v;
  };
  for (const Triangle& triangle : body.triangles) {
    for (int k = 1; k < 3; ++k) {
      const int a = lowest(triangle[0]), b = lowest(triangle[k]);
      lower[std::max(a, b)] = std::min(a, b);
    }
  }
  for (int v = 0; v < static_cast<int>(lower.size()); ++v) lower[v] = lowest(v);
  return lower;
}

}  // namespace

DrawnPieces drawn_pieces(const BodyTopology& body) {
  const std::vector<int> lowest = lowest_of_chain(body);
  std::vector<int> size(lowest.size(), 0), number(lowest.size(), -1);
  for (const int v : lowest) ++size[v];
  DrawnPieces pieces;
  for (std::size_t v = 0; v < lowest.size(); ++v)
    if (size[v] >= DrawnPieces::kSmallestPiece) number[v] = pieces.count++;
  const int rest = pieces.count;
  for (const int v : lowest) {
    const int piece = number[v] < 0 ? rest : number[v];
    pieces.piece_of.push_back(piece);
    pieces.count = std::max(pieces.count, piece + 1);
  }
  return pieces;
}

std::vector<PieceMotion> nearest_motions(const DrawnPieces& pieces, std::span<const Vec3f> X, std::span<const Vec3f> x) {
  assert(X.size() == pieces.piece_of.size() && x.size() == X.size());
  struct Sums {
    double vertices = 0;
    Vec3 X = Vec3::Zero(), x = Vec3::Zero();
    Mat3 x_X = Mat3::Zero();
  };
  std::vector<Sums> sums(pieces.count);
  for (std::size_t v = 0; v < X.size(); ++v) {
    Sums& of = sums[pieces.piece_of[v]];
    of.vertices += 1;
    of.X += X[v].cast<double>();
    of.x += x[v].cast<double>();
  }
  for (Sums& of : sums) {
    of.X /= of.vertices;
    of.x /= of.vertices;
  }
  for (std::size_t v = 0; v < X.size(); ++v) {
    Sums& of = sums[pieces.piece_of[v]];
    of.x_X += (x[v].cast<double>() - of.x) * (X[v].cast<double>() - of.X).transpose();
  }
  std::vector<PieceMotion> motions(pieces.count);
  for (int p = 0; p < pieces.count; ++p) {
    const Eigen::JacobiSVD<Mat3> svd(sums[p].x_X, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Mat3 R = svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    const Eigen::Quaternionf q(Quat(R).normalized().cast<float>());
    const PieceMotion motion{q, (sums[p].x - PieceMotion{q}.rotation() * sums[p].X).cast<float>()};
    if (motion.R.coeffs().allFinite() && motion.t.allFinite()) motions[p] = motion;
  }
  return motions;
}

}  // namespace crumple
