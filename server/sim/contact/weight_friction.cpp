#include "server/sim/contact/weight_friction.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple::sim::contact {

double weight_speed(double mu, const Vec3& normal, const Vec3& gravity, double dt) {
  return dt * mu * std::abs(normal.dot(gravity));
}

void set_weight_friction(double mass, std::span<const Vec3> u, std::span<ContactRow> rows) {
  assert(u.size() == rows.size());
  double volume = 0;
  for (const ContactRow& row : rows) volume += row.active ? row.volume : 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    ContactRow& row = rows[k];
    if (!row.active || !(row.weight_speed > 0)) continue;
    const double impulse = mass * row.weight_speed * row.volume / volume;
    const double speed = (u[k] - row.normal.dot(u[k]) * row.normal).norm();
    row.c_t = std::min(row.c_n, impulse / std::max(speed, 1e-300));
  }
}

}  // namespace crumple::sim::contact
