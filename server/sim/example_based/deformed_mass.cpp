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

  Mat3 moment = Mat3::Zero();
  for (std::size_t t = 0; t < tets.size(); ++t) {
    Mat34 r;
    for (int k = 0; k < 4; ++k) r.col(k) = x[tets[t][k]] - result.com;
    const Vec3 s = r.rowwise().sum();
    moment += rest.tet_share[t] / 20 * (r * r.transpose() + s * s.transpose());
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
