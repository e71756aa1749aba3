#include "common/text.h"
#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/example_trial.h"
#include "server/lab/stability/heat_map.h"
#include "server/lab/stability/soft_trial.h"

#include <algorithm>
#include <cmath>

namespace crumple::lab::stability {
namespace {

const std::vector<double> kSteps{1.0 / 1000, 1.0 / 480, 1.0 / 240, 1.0 / 120, 1.0 / 60, 1.0 / 30, 1.0 / 15};  // [s]

// A scrambled cube of 162 tets, for a second or for ten times that a wave needs through it, 10 s at most.
Cell scrambled(const Method& method, const sim::TetMesh& mesh, const sim::fem::FemMaterial& material, double dt) {
  SoftTrial trial(mesh, material, method.fem);
  Random random(1);
  trial.deform([&](const Vec3&) { return random.vec3(0, 1); });
  const double crossing = 1 / std::sqrt(material.young / material.density), start = trial.energy();
  const double seconds = std::clamp(10 * crossing, std::max(1.0, 60 * dt), 10.0);
  trial.run(seconds / 2, dt);
  const double half = trial.energy();
  double largest = trial.largest_energy;
  trial.run(seconds / 2, dt);
  largest = std::max(largest, trial.largest_energy);
  if (!trial.sound()) return {CellState::not_finite, "not finite or unbounded"};
  const double drift = trial.momentum().norm() / trial.rest.mass(), end = trial.energy();
  const int inverted = trial.inverted();
  const std::string note = text("inverted ", inverted, "; energy left ", end / start, "; spin ", trial.spin(),
                                " rad/s; drift ", drift, " m/s");
  if (largest > 1.05 * start || (end > 1.05 * half && end > 1e-3 * start)) return {CellState::growing, note};
  if (inverted > 0) return {CellState::inverted, note};
  if (drift > 1e-3) return {CellState::drifting, note};
  return {CellState::stable, note};
}

Cell young_dt(const Method& method, double young, double dt) {
  sim::fem::FemMaterial material = soft_material();
  material.young = young;
  return scrambled(method, unit_cube(3), material, dt);
}

Cell poisson_dt(const Method& method, double nu, double dt) {
  sim::fem::FemMaterial material = soft_material();
  material.poisson = nu;
  return scrambled(method, unit_cube(3), material, dt);
}

Cell sliver_dt(const Method& method, double quality, double dt) {
  const sim::TetMesh mesh = cube_with_sliver(3, quality);
  if (!sim::validate(mesh, "mesh")) return {CellState::refused, "volume at most 1e-12 of the cubed longest edge"};
  return scrambled(method, mesh, soft_material(), dt);
}

Cell cap_young(const Method& method, double cap, double young) {
  sim::fem::FemMaterial material = soft_material();
  material.young = young;
  material.cg_max_iterations = static_cast<int>(cap);
  return scrambled(method, unit_cube(3), material, 1.0 / 60);
}

Cell mass_dt(const Method& method, double ratio, double dt) {
  const HeavyOnLight result = heavy_on_light(method.contact, ratio, dt, 3);
  if (!result.sound) return {CellState::not_finite, "not finite or unbounded"};
  const std::string note = text("overlap ", 100 * result.penetration, " %; rms speed ", result.speed,
                                " m/s; energy rise in a step ", result.energy_rise, " m g m");
  if (result.fell) return {CellState::passed, note};
  if (result.inverted > 0) return {CellState::inverted, note};
  if (result.energy_rise > 1e-3) return {CellState::growing, note};
  if (result.penetration > 0.05 || result.speed > 0.01) return {CellState::drifting, note};
  return {CellState::stable, note};
}

Cell speed_thickness(const Method& method, double speed, double thickness) {
  Cell worst;
  for (const double phase : {0.0, 0.3, 0.6}) {
    const Shot shot = shot_at_plate(method.contact, {.size = Vec3::Constant(0.3),
                                                     .speed = speed,
                                                     .thickness = thickness,
                                                     .phase = phase,
                                                     .sixth_rule = method.contact.settings.raw_damping});
    const std::string note =
        text("rebound ", shot.rebound, " of the speed; ", 1000 * shot.penetration, " mm inside at the end");
    Cell cell{CellState::stable, note};
    if (!shot.sound)
      cell.state = CellState::not_finite;
    else if (shot.behind)
      cell.state = CellState::passed;
    else if (shot.rebound > 1)
      cell.state = CellState::growing;
    else if (shot.penetration > 0.01)
      cell.state = CellState::drifting;
    if (worst.note.empty() || severity(cell.state) > severity(worst.state)) worst = cell;
  }
  return worst;
}

Cell impulse_gamma(const Method& method, double impulse, double gamma) {
  ExampleTrial trial(bar_set(usual_poses()), method.example);
  trial.parameters.gamma = gamma;
  const Battered result = batter(trial, impulse, 60);
  if (!result.finite || !(result.simplex_error < 1e-9))
    return {CellState::not_finite, "not finite or outside the simplex"};
  const std::string note = text(result.inverted, " tets of the skin inverted; largest move in a step ", result.jump,
                                " m; still moving ", result.last_move, " m");
  if (result.inverted > 0) return {CellState::inverted, note};
  if (result.jump > 0.16) return {CellState::growing, note};
  if (result.last_move > 1e-5) return {CellState::drifting, note};
  return {CellState::stable, note};
}

const char* kScrambled =
    "A cell is a scrambled cube of side 1 m (162 tets, every vertex at a random place in the box) let go without "
    "gravity for one to ten seconds. "
    "Inverted: tets of negative volume are left at the end. Energy growing: kinetic and elastic energy rise above the "
    "start's, or in the second half. "
    "Drifting: the centre of mass moves faster than 1 mm/s.";

std::vector<HeatMap> make_maps() {
  const std::vector<double> young{1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11};
  return {
      {"E-dt", "Stiffness and time step", kScrambled, Family::fem, {"E", "Pa", young}, {"dt", "s", kSteps}, young_dt},
      {"nu-dt",
       "Incompressibility and time step",
       std::string(kScrambled) + " E = 1e5 Pa.",
       Family::fem,
       {"nu", "", {0, 0.3, 0.4, 0.45, 0.49, 0.499, 0.4999}},
       {"dt", "s", kSteps},
       poisson_dt},
      {"sliver-dt",
       "Slivers and time step",
       std::string(kScrambled) + " E = 1e5 Pa; two tets have only this part of their height.",
       Family::fem,
       {"height", "", {1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1}},
       {"dt", "s", kSteps},
       sliver_dt},
      {"cap-E",
       "Iteration cap and stiffness",
       std::string(kScrambled) + " dt = 1/60 s.",
       Family::fem,
       {"cap", "iterations", {1, 2, 5, 10, 20, 50, 100, 400, 1000}},
       {"E", "Pa", young},
       cap_young,
       true},
      {"mass-dt",
       "Mass ratio and time step",
       "A cell is a block of 1 m and 100 kg on the ground under one of this many times its density (E = 1e9 Pa) for "
       "three seconds. Passed through: the heavy block has sunk below the light "
       "one's middle or fallen off. Energy growing: in the last second the energy rises in a step by more than a "
       "thousandth of the heavy block's weight times a metre. Drifting: rms speed above "
       "1 cm/s or overlap above 5 % in the last second.",
       Family::contact,
       {"ratio", "", {1, 10, 100, 1e3, 1e4}},
       {"dt", "s", {1.0 / 480, 1.0 / 240, 1.0 / 120, 1.0 / 60, 1.0 / 30, 1.0 / 15}},
       mass_dt},
      {"speed-thickness",
       "Speed and thickness",
       "A cell is a cube of 0.3 m shot at a fixed plate, dt = 1/60 s, at three phases of the step; the worst counts. "
       "Passed through: it ends behind the plate. Energy growing: it comes back "
       "faster than it came. Drifting: it stays more than 1 cm inside.",
       Family::contact,
       {"speed", "m/s", {1, 3, 10, 30, 100, 300, 1000}},
       {"thickness", "m", {0.001, 0.003, 0.01, 0.03, 0.1, 0.3}},
       speed_thickness},
      {"impulse-gamma",
       "Impulse and kernel radius",
       "A cell is a bar of 1.6 m and 100 kg that takes 60 impacts of this impulse on random places, then rests for a "
       "second. Inverted: the skin passes through itself at the end. Energy growing: "
       "a vertex of the skin jumps by more than a tenth of the body in one step, which collision would answer with "
       "energy. Drifting: the skin still moves after the rest.",
       Family::example,
       {"impulse", "N s", {1, 10, 30, 100, 300, 1e3, 1e4, 1e5}},
       {"gamma", "m", {0.1, 0.25, 0.5, 1, 2, 4}},
       impulse_gamma},
  };
}

}  // namespace

const std::vector<HeatMap>& all_maps() {
  static const std::vector<HeatMap> maps = make_maps();
  return maps;
}

}  // namespace crumple::lab::stability
