#include "server/sim/example_based/deformed_mass.h"

#include <cassert>

namespace crumple::sim::example_based {
namespace {

Mat3 inertia_of(const Mat3& second_moment) { return second_moment.trace() * Mat3::Identity() - second_moment; }

}  // namespace

DeformedMass deformed_mass(const ExampleRest& rest, std::span<const Vec3> x, double mass) {
  const std::vector<Tet>& tets = rest.set->mesh.tets;
  assert(static_cast<int>(x.size()) == rest.vertex_count());
  DeformedMass result;
  result.mass = mass;
  // A tet's centroid is the mean of its vertices, so lumping keeps the centre of mass.
  for (std::size_t i = 0; i < x.size(); ++i) result.com += rest.vertex_share[i] * x[i];

  // sum_t m_t / 20 (sum_k r_k r_k^T + s s^T), r about the centre of mass: the first sum goes over vertices, each of which
  // has a quarter of its tets' shares.
  Mat3 moment = Mat3::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 r = x[i] - result.com;
    moment += (rest.vertex_share[i] / 5 * r) * r.transpose();
  }
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const auto& [a, b, c, d] = tets[t];
    const Vec3 s = (x[a] + x[b]) + (x[c] + x[d]) - 4 * result.com;
    moment += (rest.tet_share[t] / 20 * s) * s.transpose();
  }
  result.inertia = mass * inertia_of(moment);
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
