#include "server/sim/fracture/separation_tensor.h"

#include <Eigen/Eigenvalues>

#include <cassert>
#include <cmath>

namespace crumple::sim::fracture {

namespace {

constexpr int kChunk = 256;

int local_index(const Tet& tet, int node) {
  for (int k = 0; k < 3; ++k)
    if (tet[k] == node) return k;
  assert(tet[3] == node);
  return 3;
}

}  // namespace

Mat3 outer_by_length(const Vec3& a) {
  const double length = a.norm();
  if (length == 0) return Mat3::Zero();
  return a * (a / length).transpose();
}

Mat3 tensile_part(const Mat3& sigma) {
  // The closed form takes half the iteration's time (24,000 tets: 4.7 against 10.6 ms) and is exact to 1e-14 of |sigma|,
  // where two eigenvalues nearly coincide to 1e-8: far below what a toughness is known to.
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(sigma);
  Mat3 tensile = Mat3::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vec3 n = eigen.eigenvectors().col(i);
    tensile += std::max(0.0, eigen.eigenvalues()[i]) * n * n.transpose();
  }
  return tensile;
}

void separation_tensors(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat3> stress,
                        std::span<const Mat34> normals, const ThreadPool& pool, PartForces& forces,
                        std::span<Mat3> S) {
  assert(stress.size() == tets.size() && normals.size() == tets.size());
  assert(static_cast<int>(S.size()) == stars.node_count());
  forces.tensile.resize(tets.size());
  forces.compressive.resize(tets.size());
  pool.for_chunks(static_cast<int>(tets.size()), kChunk, [&](int begin, int end) {
    for (int t = begin; t < end; ++t) {
      const Mat3 tensile = tensile_part(stress[t]);
      forces.tensile[t] = tensile * normals[t] / 3;
      forces.compressive[t] = (stress[t] - tensile) * normals[t] / 3;
    }
  });
  pool.for_chunks(stars.node_count(), kChunk, [&](int begin, int end) {
    for (int node = begin; node < end; ++node) {
      Vec3 F_plus = Vec3::Zero(), F_minus = Vec3::Zero();
      Mat3 sum = Mat3::Zero();
      for (const int t : stars[node]) {
        const int k = local_index(tets[t], node);
        const Vec3 f_plus = forces.tensile[t].col(k), f_minus = forces.compressive[t].col(k);
        F_plus += f_plus;
        F_minus += f_minus;
        sum += outer_by_length(f_plus) - outer_by_length(f_minus);
      }
      S[node] = 0.5 * (sum - outer_by_length(F_plus) + outer_by_length(F_minus));
    }
  });
}

double cut_area(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat34> normals, int node,
                const Vec3& e) {
  double sum = 0;
  for (const int t : stars[node]) sum += std::abs(normals[t].col(local_index(tets[t], node)).dot(e));
  return sum / 6;
}

std::vector<SplitCandidate> split_candidates(const std::vector<Tet>& tets, const NodeStars& stars,
                                             std::span<const Mat34> normals, std::span<const Mat3> S,
                                             double toughness, bool raw_toughness, const ThreadPool& pool) {
  assert(toughness >= 0);
  std::vector<SplitCandidate> strongest(S.size());
  pool.for_chunks(static_cast<int>(S.size()), kChunk, [&](int begin, int end) {
    for (int node = begin; node < end; ++node) {
      if (!S[node].allFinite()) continue;
      const Eigen::SelfAdjointEigenSolver<Mat3> eigen(S[node]);
      for (int i = 2; i >= 0; --i) {  // ascending; the largest may be beaten once areas count
        const double eigenvalue = eigen.eigenvalues()[i];
        if (!(eigenvalue > 0)) break;
        const Vec3 e = eigen.eigenvectors().col(i);
        const double area = raw_toughness ? 1 : cut_area(tets, stars, normals, node, e);
        const double strength = area > 0 ? eigenvalue / area : 0;
        if (strength > strongest[node].strength) strongest[node] = {node, e, strength};
      }
    }
  });
  std::erase_if(strongest, [&](const SplitCandidate& c) { return !(c.strength > toughness && std::isfinite(c.strength)); });
  return strongest;
}

}  // namespace crumple::sim::fracture
