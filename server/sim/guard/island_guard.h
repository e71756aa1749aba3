#pragma once

#include <cstdint>
#include <optional>

// Watches what the bodies of an island do and says when to step them more carefully. It knows numbers only: a world
// measures, asks, and acts (server/sim/world_guard.cpp).
//
// | quantity   | what is measured in a step                                   | bound                          | top rung      |
// |------------|--------------------------------------------------------------|--------------------------------|---------------|
// | energy     | growth beyond the work done on the island, summed over steps | 5 % of its energy, or that of  | sub_steps;    |
// |            | and halved every kHalfLife of them, kInARow steps in a row;  | kFloorSpeed, if that is more   | frozen beyond |
// |            | kGoesOn of the bound have come since it was passed: a jump   |                                | kRunaway      |
// |            | that stays alone (a shard that snaps free) does not grow     |                                |               |
// | inverted   | tets of negative volume, in how many steps in a row          | kPatience                      | sub_steps     |
// | residual   | of solves that ended at their cap, kInARow steps in a row    | kResidual                      | more_iterations |
//
// A state that is not finite needs no watching: SoftBody::advance holds the body at once, and its guard is frozen.
namespace crumple::sim::guard {

// What is done about it, one rung after the other, each in addition to those before.
enum class Rung : std::uint8_t {
  normal,
  more_iterations,  // of the solve: kIterations times the cap, kTolerance times the tolerance
  safe_rotation,    // sign-corrected SVD, whatever the material says
  sub_steps,        // the island takes kSubSteps steps in one
  frozen,           // held where it last was
};
enum class Quantity : std::uint8_t { energy, inverted, residual };

inline constexpr int kPatience = 10;     // steps on a rung before the next one
inline constexpr int kCalm = 120;        // steps without a finding before a rung is left again
inline constexpr int kHalfLife = 10;     // steps
inline constexpr int kInARow = 4;        // steps: a linearised step stores energy and gives it back in the next
inline constexpr double kGoesOn = 0.5;   // of the bound
inline constexpr double kRunaway = 10;   // times the energy there was when the first rung was climbed
inline constexpr double kResidual = 0.05;  // relative: what a cap may leave without a word
inline constexpr double kEnergyPart = 0.05;
inline constexpr double kFloorSpeed = 0.1;  // [m/s] of the whole body: less is not worth a word
inline constexpr int kIterations = 4;
inline constexpr double kTolerance = 1e-3;
inline constexpr int kSubSteps = 4;

// One body's part in one step, and its island's energy.
struct Measurement {
  double surplus = 0;   // growth of kinetic + elastic + gravitational energy of the island beyond work done on it [J]
  double energy = 0;    // kinetic + elastic of the island, and what work went in or out [J]
  double mass = 0;      // of the island's finite-element bodies [kg]
  int inverted = 0;     // tets
  bool capped = false;
  double residual = 0;  // relative, of the last solve
};

// State, one a body, and one each piece of a broken one.
struct BodyGuard {
  Rung rung = Rung::normal;
  double surplus = 0;      // [J], decaying
  double jump = 0;         // [J], the least that surplus was since it passed its bound, decaying alike
  double energy = 0;       // [J], the largest of late, decaying
  double energy_at_alarm = 0;  // [J], when the first rung was climbed
  int growing_steps = 0;   // in a row
  int inverted_steps = 0;  // in a row
  int capped_steps = 0;
  int steps_on_rung = 0;
  int calm_steps = 0;
};

// A rung climbed (up) or left (not up), because `quantity` was `value` where `bound` is allowed.
struct Finding {
  Quantity quantity = Quantity::energy;
  double value = 0, bound = 0;
  bool up = true;
  Rung rung = Rung::normal;  // from now on
};

std::optional<Finding> watch(const Measurement& measured, BodyGuard& guard);

const char* name(Rung rung);          // "more iterations", ...
const char* name(Quantity quantity);  // "energy without work [J]", ...

}  // namespace crumple::sim::guard
