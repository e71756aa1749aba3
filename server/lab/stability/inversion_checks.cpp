#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

// Rows about shapes that no motion leads to: inverted, mirrored, collapsed, crushed and stretched bodies come back.
namespace crumple::lab::stability {
namespace {

constexpr double kDt = 1.0 / 60;     // [s]
constexpr double kRecovered = 0.01;  // [m] on a cube of 1 m
constexpr double kAtRest = 0.01;  // kinetic energy of the largest of the trial: a spin that the start made fades slowly
constexpr double kStill = 1e-5;   // the same without the rigid motion: nothing may still vibrate

// The worst of several trials of one row.
struct Worst {
  bool sound = true;
  int inverted = 0, tets = 0;
  double shape = 0, kinetic = 0,
         vibration = 0;  // kinetic energy of the largest: all, and without that of a rigid motion

  void add(const SoftTrial& trial) {
    sound = sound && trial.sound();
    inverted = std::max(inverted, trial.inverted());
    tets = trial.mesh.tet_count();
    shape = std::max(shape, trial.shape_error());
  }
  // Row 1's criterion: the shape within 120 steps, then rest.
  void recover(SoftTrial& trial, double then) {
    trial.run(2, kDt);
    add(trial);
    if (!sound) return;
    const double largest = trial.largest_kinetic;
    trial.run(then, kDt);
    sound = trial.sound();
    if (!sound || largest == 0) return;
    kinetic = std::max(kinetic, trial.kinetic() / largest);
    vibration = std::max(vibration, std::max(0.0, trial.kinetic() - trial.rigid_kinetic()) / largest);
  }
  std::string calm(double after) const {
    return text("; kinetic energy left after ", after, " s ", 100 * kinetic, " % of the largest, ", 100 * vibration,
                " % without the spin");
  }
  // Tets that stay inverted are the failure itself, whatever else is well.
  Outcome outcome(const std::string& more = "") const {
    if (!sound) return judged(false, false, tets, "not finite or unbounded" + more);
    const std::string found =
        text(inverted, " of ", tets, " tets stay inverted, shape error ", 100 * shape, " % of the side", more);
    if (inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
    const bool calm = kinetic < kAtRest && vibration < kStill;
    return judged(true, shape < kRecovered && calm, calm ? shape : std::max(kinetic, vibration), found);
  }
};

Outcome inverted_elements(const Method& method, const Effort& effort) {
  const int cells = effort.brief ? 3 : 4, seeds = effort.brief ? 1 : 3;
  const double then = effort.brief ? 4 : 8;
  Worst worst;
  for (int seed = 1; seed <= seeds + 1 && worst.sound; ++seed) {
    SoftTrial trial(unit_cube(cells), soft_material(), method.fem);
    const bool wide = seed > seeds;
    scramble(trial, seed, wide ? -1 : 0, wide ? 2 : 1);
    worst.recover(trial, then);
  }
  return worst.outcome(worst.calm(2 + then));
}

Outcome reflection(const Method& method, const Effort& effort) {
  Worst worst;
  for (const bool scrambled : {false, true}) {
    SoftTrial trial(unit_cube(effort.brief ? 3 : 4), soft_material(), method.fem);
    Random random(2);
    trial.deform([&](const Vec3& X) -> Vec3 { return scrambled ? random.vec3(0, 1) : Vec3(1 - X.x(), X.y(), X.z()); });
    trial.run(2, kDt);
    worst.add(trial);
  }
  // The rule itself, over every sign of det F.
  Random random(8);
  int mirrors = 0;
  const int tried = effort.brief ? 1000 : 10'000;
  for (int k = 0; k < tried; ++k) {
    Mat3 F;
    F << random.vec3(-1, 1), random.vec3(-1, 1), random.vec3(-1, 1);
    mirrors += method.fem.rotation(F).determinant() < 0;
  }
  Outcome outcome = worst.outcome(text("; det Q = -1 for ", mirrors, " of ", tried, " random F"));
  if (mirrors > 0) outcome.verdict = Verdict::fails;
  return outcome;
}

Outcome collapse(const Method& method, const Effort& effort) {
  Worst worst;
  const double then = effort.brief ? 4 : 8;
  for (const double noise : {0.0, 1e-6})
    for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)}) {
      if (!worst.sound) break;
      SoftTrial trial(unit_cube(effort.brief ? 2 : 4), soft_material(), method.fem);
      Random random(5);
      trial.deform([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X) + random.vec3(-noise, noise); });
      worst.recover(trial, then);
    }
  return worst.outcome(worst.calm(2 + then));
}

Outcome compression(const Method& method, const Effort& effort) {
  const double speed = 0.9;  // [m/s]: to 10 % in a second
  SoftTrial trial(unit_cube(effort.brief ? 2 : 4), soft_material(), method.fem);
  const auto plates = [&](double v) {
    trial.prescribed.clear();
    for (int i = 0; i < trial.mesh.node_count(); ++i) {
      if (trial.mesh.X[i].y() == 0) trial.prescribed.push_back({i, Vec3::Zero()});
      if (trial.mesh.X[i].y() == 1) trial.prescribed.push_back({i, Vec3(0, v, 0)});
    }
  };
  plates(-speed);
  trial.run(1, kDt);
  const int squeezed = trial.inverted();
  plates(speed);
  trial.run(1, kDt);
  plates(0);
  trial.run(2, kDt);
  Worst worst;
  worst.add(trial);
  return worst.outcome(text("; ", squeezed, " inverted at 10 % height"));
}

Outcome stretch(const Method& method, const Effort& effort) {
  SoftTrial trial(unit_cube(effort.brief ? 2 : 4), soft_material(), method.fem);
  trial.deform([](const Vec3& X) { return Vec3(100 * X.x(), X.y(), X.z()); });
  const double start = trial.energy();
  // No node may be faster than if it had all of the energy.
  double speed = 0;
  trial.run(effort.brief ? 5 : 20, kDt, [&] {
    for (int i = 0; i < trial.mesh.node_count(); ++i)
      speed = std::max(speed, trial.state.v[i].norm() * std::sqrt(0.5 * trial.rest.node_mass[i] / start));
    return true;
  });
  const double left = trial.energy() / start, gained = trial.largest_energy / start, shape = trial.shape_error();
  const int inverted = trial.inverted();
  const std::string found =
      text("shape error ", 100 * shape, " % of the side, spin ", trial.spin(), " rad/s; energy left ", left,
           " of the start's, never above ", gained, " of it; fastest node at ", speed,
           " of the speed that all of the energy would give it; ", inverted, " inverted");
  if (trial.sound() && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(trial.sound(), gained < 1 + 1e-9 && speed <= 1 && left < 1e-3 && shape < kRecovered, shape, found);
}

}  // namespace

std::vector<Row> inversion_rows() {
  return {
      {1, "Inverted elements",
       "Cube of 4^3 x 6 tets, every vertex random in its box (three seeds) and in three times its box; E = 1e5, nu = "
       "0.3, dt = 1/60 s",
       "0 inverted and shape error < 1 % of the side within 120 steps, kinetic energy < 0.1 % of the largest after 10 "
       "s",
       Family::fem, inverted_elements, 6},
      {2, "Reflection taken for rest (det Q < 0)", "The cube mirrored, x to 1 - x, and scrambled; 10,000 random F",
       "un-mirrors: 0 inverted, shape error < 1 %; det Q = 1 for every F", Family::fem, reflection, 1.5},
      {3, "Collapse to a plane, a line, a point", "X diag(1,1,0), (1,0,0), 0, exact and with 1e-6 m of noise",
       "as row 1", Family::fem, collapse, 12},
      {6, "90 % compression and release", "Plates squeeze the cube to 10 % in a second and open in a second",
       "shape back within 1 %", Family::fem, compression, 2},
      {7, "100 x stretch and release", "X diag(100,1,1), 20 s",
       "nothing inverted, shape error < 1 % and energy < 0.1 % of the start's at the end, never above it; no node "
       "faster "
       "than all of the energy could make it",
       Family::fem, stretch, 4},
  };
}

}  // namespace crumple::lab::stability
