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
double work_of(std::span<const fem::PrescribedNode> prescribed, const fem::RestBody& rest, const std::vector<Tet>& tets,
               const fem::Elements& elements, double dt) {
  Eigen::VectorXd f(3 * rest.node_count());
  fem::gather_forces(rest, tets, elements, f);
  double work = 0;
  for (const fem::PrescribedNode& p : prescribed) work -= dt * p.velocity.dot(f.segment<3>(3 * p.node));
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
    prescribed_work_ = work_of(prescribed_before_, rest, tets, system.elements, dt);
  }
}

double SoftBody::prescribed_work_now(const Vec3& gravity, double dt) const {
  if (!any_moves(prescribed_) && !any_moves(prescribed_before_)) return 0;
  double work = work_of(prescribed_, rest, tets, elements_now(), dt);
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
