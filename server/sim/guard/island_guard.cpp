#include "server/sim/guard/island_guard.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::guard {
namespace {

Rung next(Rung rung) { return static_cast<Rung>(static_cast<int>(rung) + 1); }
Rung previous(Rung rung) { return static_cast<Rung>(static_cast<int>(rung) - 1); }

// What is beyond its bound, the gravest first.
std::optional<Finding> breach(const Measurement& m, const BodyGuard& guard, double energy_bound) {
  const bool goes_on = guard.surplus > guard.jump + kGoesOn * energy_bound;
  if (guard.growing_steps >= kInARow && goes_on) return Finding{Quantity::energy, guard.surplus, energy_bound};
  if (guard.inverted_steps > kPatience) {
    return Finding{Quantity::inverted, static_cast<double>(m.inverted), 0};
  }
  if (guard.capped_steps >= kInARow) return Finding{Quantity::residual, m.residual, kResidual};
  return std::nullopt;
}

Rung top(Quantity quantity, const Measurement& m, const BodyGuard& guard) {
  if (quantity == Quantity::residual) return Rung::more_iterations;
  const bool runs_away = quantity == Quantity::energy && m.energy > kRunaway * guard.energy_at_alarm;
  return runs_away ? Rung::frozen : Rung::sub_steps;
}

}  // namespace

std::optional<Finding> watch(const Measurement& m, BodyGuard& guard) {
  if (guard.rung == Rung::frozen) return std::nullopt;
  const double decay = std::exp2(-1.0 / kHalfLife);
  guard.surplus = std::max(0.0, decay * guard.surplus + m.surplus);
  guard.energy = std::max(m.energy, decay * guard.energy);
  guard.inverted_steps = m.inverted > 0 ? guard.inverted_steps + 1 : 0;
  guard.capped_steps = m.capped && m.residual > kResidual ? guard.capped_steps + 1 : 0;
  const double floor = 0.5 * m.mass * kFloorSpeed * kFloorSpeed;
  const double energy_bound = std::max(floor, kEnergyPart * guard.energy);
  guard.growing_steps = guard.surplus > energy_bound ? guard.growing_steps + 1 : 0;
  guard.jump = guard.growing_steps == 1 ? guard.surplus : std::min(decay * guard.jump, guard.surplus);
  ++guard.steps_on_rung;

  std::optional<Finding> found = breach(m, guard, energy_bound);
  if (!found) {
    if (guard.rung == Rung::normal || ++guard.calm_steps < kCalm) return std::nullopt;
    guard.calm_steps = guard.steps_on_rung = 0;
    guard.rung = previous(guard.rung);
    return Finding{.up = false, .rung = guard.rung};
  }
  guard.calm_steps = 0;
  const bool waits = guard.rung != Rung::normal && guard.steps_on_rung < kPatience;
  if (waits || guard.rung >= top(found->quantity, m, guard)) return std::nullopt;
  if (guard.rung == Rung::normal) guard.energy_at_alarm = std::max(guard.energy, floor);
  guard.rung = found->rung = next(guard.rung);
  guard.steps_on_rung = 0;
  guard.surplus = guard.jump = guard.growing_steps = 0;  // the new rung is judged by what happens on it
  return found;
}

const char* name(Rung rung) {
  switch (rung) {
    case Rung::normal: return "normal";
    case Rung::more_iterations: return "more iterations";
    case Rung::safe_rotation: return "rotation by SVD";
    case Rung::sub_steps: return "sub-steps";
    case Rung::frozen: return "frozen";
  }
  return "";
}

const char* name(Quantity quantity) {
  switch (quantity) {
    case Quantity::energy: return "energy without work [J]";
    case Quantity::inverted: return "inverted tets that stay";
    case Quantity::residual: return "relative residual of the solve";
  }
  return "";
}

}  // namespace crumple::sim::guard
