#include "server/sim/example_based/deformed_mass.h"

#include <cassert>

namespace crumple::sim::example_based {
namespace {

Mat3 inertia_of(const Mat3& second_moment) { return second_moment.trace() * Mat3::Identity() - second_moment; }

}  // namespace

DeformedMass deformed_mass(const ExampleRest& rest, std::span<const Vec3> x, double mass) {
  assert(static_cast<int>(x.size()) == rest.vertex_count());
  DeformedMass result;
  result.mass = mass;
  // A tet's centroid is the mean of its vertices, so lumping keeps the centre of mass.
  for (std::size_t i = 0; i < x.size(); ++i) result.com += rest.vertex_share[i] * x[i];

  // sum_t m_t / 20 (sum_k r_k r_k^T + s s^T), r about the centre of mass and s a tet's sum of them, is sum_ij M_ij r_i r_j^T
  // with M the consistent mass matrix: a third of the work, since there are fewer edges than tets' corners.
  Mat3 moment = Mat3::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    Vec3 sum = rest.vertex_share[i] / 5 * x[i];  // half of M_ii
    double share = rest.vertex_share[i] / 5;
    for (int k = rest.upper_start[i]; k < rest.upper_start[i + 1]; ++k) {
      const auto& [j, edge_share] = rest.upper_edges[k];
      sum += edge_share * x[j];
      share += edge_share;
    }
    moment += (x[i] - result.com) * (sum - share * result.com).transpose();
  }
  result.inertia = mass * inertia_of(moment + moment.transpose());
  return result;
}

DeformedMass lumped_mass(const ExampleRest& rest, std::span<const Vec3> x, double mass) {
  assert(static_cast<int>(x.size()) == rest.vertex_count());
  DeformedMass result;
  result.mass = mass;
  for (std::size_t i = 0; i < x.size(); ++i) result.com += rest.vertex_share[i] * x[i];
  Mat3 moment = Mat3::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 r = x[i] - result.com;
    moment += rest.vertex_share[i] * r * r.transpose();
  }
  result.inertia = mass * inertia_of(moment);
  return result;
}

int inverted_tets(const ExampleRest& rest, std::span<const Vec3> x) {
  int count = 0;
  for (const auto& [a, b, c, d] : rest.set->mesh.tets) count += (x[b] - x[a]).cross(x[c] - x[a]).dot(x[d] - x[a]) < 0;
  return count;
}

}  // namespace crumple::sim::example_based
