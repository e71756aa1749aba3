#include "server/sim/bodies/soft_body.h"

#include <algorithm>

// Which formula a step is taken by, and what it is measured by before it is.
namespace crumple::sim {

void SoftBody::restart() {
  if (options_.integrator == Integrator::bdf2) fem::restart(state);
}

// Leaves the state without memory where this step must be one of backward Euler.
void SoftBody::choose_formula(double dt, const ThreadPool& pool) {
  if (options_.integrator != Integrator::bdf2) return;
  if (frozen) return restart();
  fem::restart_near_inversion(rest, tets, dt, pool, state);
}

namespace {

// Work in dt that prescribed nodes do on the elements at them [J].
double work_of(std::span<const fem::PrescribedNode> prescribed, const std::vector<Tet>& tets, int node_count,
               const fem::Elements& elements, double dt) {
  std::vector<Vec3> velocity(node_count, Vec3::Zero());
  for (const fem::PrescribedNode& p : prescribed) velocity[p.node] = p.velocity;
  double work = 0;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) work -= dt * velocity[tets[t][k]].dot(elements.force[t].col(k));
  }
  return work;
}

bool any_moves(std::span<const fem::PrescribedNode> prescribed) {
  return std::ranges::any_of(prescribed, [](const fem::PrescribedNode& p) { return !p.velocity.isZero(0); });
}

}  // namespace

void SoftBody::measure(double dt) {
  if (!options_.watched) return;
  elastic_ = fem::elastic_energy(rest, system.elements);
  prescribed_work_ = 0;
  if (any_moves(prescribed_before_)) {
    prescribed_work_ = work_of(prescribed_before_, tets, node_count(), system.elements, dt);
  }
}

double SoftBody::prescribed_work_now(const Vec3& gravity, double dt) const {
  if (!any_moves(prescribed_) && !any_moves(prescribed_before_)) return 0;
  double work = work_of(prescribed_, tets, node_count(), elements_now(), dt);
  const auto kinetic = [&](const fem::PrescribedNode& p) { return 0.5 * rest.node_mass[p.node] * p.velocity.squaredNorm(); };
  for (const fem::PrescribedNode& p : prescribed_) work += kinetic(p) - dt * rest.node_mass[p.node] * gravity.dot(p.velocity);
  for (const fem::PrescribedNode& p : prescribed_before_) work -= kinetic(p);
  return work;
}

fem::Elements SoftBody::elements_now() const {
  fem::Elements elements;
  fem::update_elements(rest, tets, state.x, state.plastic_strain, ThreadPool(1), elements);
  return elements;
}

}  // namespace crumple::sim
