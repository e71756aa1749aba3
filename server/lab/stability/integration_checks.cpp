#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/lab/stability/beam_and_modes.h"

#include <algorithm>
#include <cmath>

// Rows about the integrator and the solver of one body.
namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;

constexpr double kDt = 1.0 / 60;  // [s]

// Energy kept per step by a small oscillation of a mode, against 1 / (1 + (omega dt)^2) of backward Euler [FORMULAS
// F2].
struct Decay {
  double worst_error = 0;  // relative, of the energy kept in a step
  double fastest = 0;      // h = omega dt of the stiffest sample
  bool sound = true;
};

Decay decay(const Method& method, std::initializer_list<double> steps) {
  Decay result;
  for (const double dt : steps) {
    SoftTrial trial(unit_cube(2), soft_material(), method.fem);
    for (const Mode& mode : {free_modes(trial, 1).front(), free_modes(trial, 12).back()}) {
      trial.deform([](const Vec3& X) { return X; });
      for (int i = 0; i < trial.mesh.node_count(); ++i) trial.state.v[i] = 1e-4 * mode.shape.segment<3>(3 * i);
      const double h = mode.omega * dt, before = trial.kinetic();
      const int n = 4;
      trial.run(n * dt, dt);
      const double kept = std::pow(trial.energy() / before, 1.0 / n), expected = 1 / (1 + h * h);
      result.sound = result.sound && trial.sound();
      result.fastest = std::max(result.fastest, h);
      result.worst_error = std::max(result.worst_error, std::abs(kept - expected) / expected);
    }
  }
  return result;
}

Outcome time_steps(const Method& method, const Effort& effort) {
  std::string broken;
  bool sound = true;
  int inverted = 0;
  for (const double rate : {1000.0, 480.0, 240.0, 120.0, 60.0, 30.0, 15.0}) {
    if (effort.brief && (rate == 480 || rate == 120 || rate == 30)) continue;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), soft_material(), method.fem);
    Random random(1);
    trial.deform([&](const Vec3&) { return random.vec3(0, 1); });
    trial.run(3, 1 / rate);
    const bool finite = trial.sound();
    const int left = finite ? trial.inverted() : trial.mesh.tet_count();
    if (left > 0) broken += text(" 1/", rate, finite ? "" : " (not finite)");
    sound = sound && finite;
    inverted = std::max(inverted, left);
  }
  const std::string found =
      broken.empty() ? "recovers at every dt from 1/1000 to 1/15 s" : "does not recover at dt =" + broken + " s";
  if (sound && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(sound, inverted == 0, inverted, found);
}

Outcome capped_solver(const Method& method, const Effort& effort) {
  double com = 0, resting = 0;
  bool sound = true, flagged = true;
  std::string found;
  for (const double young : {1e5, 1e9})
    for (const int cap : {5, 20, 100}) {
      FemMaterial material = soft_material();
      material.young = young;
      material.cg_max_iterations = cap;
      SoftTrial trial(unit_cube(effort.brief ? 3 : 4), material, method.fem);
      Random random(1);
      trial.deform([&](const Vec3&) { return random.vec3(0, 1); });
      trial.run(1, kDt);
      sound = sound && trial.sound();
      com = std::max(com, trial.momentum().norm() / trial.rest.mass());
      if (method.fem.iterates && cap == 5) flagged = flagged && trial.capped > 0;
      found += text(" E ", young, " cap ", cap, ": ", trial.capped, " capped, residual ", trial.worst_residual, ";");
    }
  FemMaterial material = soft_material();
  material.young = 1e9;
  SoftTrial trial(unit_cube(effort.brief ? 2 : 4), material, method.fem);
  Random random(1);
  trial.deform([&](const Vec3&) { return random.vec3(0, 1); });
  trial.run(1, kDt);
  sound = sound && trial.sound();
  resting = trial.momentum().norm() / trial.rest.mass();
  com = std::max(com, resting);
  return judged(sound, com < 1e-3 && flagged, com,
                text("centre of mass drifts at ", com, " m/s at most (E = 1e9, tolerance 1e-3: ", resting, ")",
                     method.fem.iterates ? ";" + found : ""));
}

Outcome sudden_load(const Method& method, const Effort& effort) {
  // Ten times the load that bends the beam far, in one step.
  FemMaterial material = soft_material();
  material.young = 1e6;
  SoftTrial trial(block({2, 0.2, 0.2}, {effort.brief ? 10 : 20, 2, 2}), material, method.fem);
  for (int i = 0; i < trial.mesh.node_count(); ++i) {
    if (trial.mesh.X[i].x() == 0) trial.prescribed.push_back({i, Vec3::Zero()});
    trial.force(3 * i + 1) = -10 * 9.81 * trial.rest.node_mass[i];
  }
  double lowest = 0, work = 0;
  std::vector<Vec3> before = trial.state.x;
  double gained = 0;
  trial.run(4, kDt, [&] {
    for (int i = 0; i < trial.mesh.node_count(); ++i) {
      lowest = std::min(lowest, trial.state.x[i].y() - trial.mesh.X[i].y());
      work += trial.force.segment<3>(3 * i).dot(trial.state.x[i] - before[i]);
    }
    before = trial.state.x;
    if (work > 0) gained = std::max(gained, trial.energy() / work);
    return true;
  });
  const double speed = std::sqrt(2 * trial.kinetic() / trial.rest.mass());
  const int inverted = trial.inverted();
  return judged(trial.sound(), lowest > -4 && gained < 1.01 && inverted == 0, gained,
                text("deepest point ", lowest, " m on a beam of 2 m; energy never above ", gained,
                     " of the load's work; after 4 s ", inverted, " inverted, rms speed ", speed, " m/s"));
}

Outcome angular_momentum(const Method& method, const Effort& effort) {
  double spin = 0, momentum = 0;
  bool sound = true;
  std::string found;
  for (const int kind : {0, 1, 2}) {
    SoftTrial trial(unit_cube(effort.brief ? 3 : 4), soft_material(), method.fem);
    Random random(1);
    trial.deform([&](const Vec3& X) -> Vec3 {
      return kind == 0   ? random.vec3(0, 1)
             : kind == 1 ? Vec3(X.x(), X.y(), 0) + random.vec3(-1e-6, 1e-6)
                         : Vec3(100 * X.x(), X.y(), X.z());
    });
    double worst = 0;
    trial.run(2, kDt, [&] {
      worst = std::max(worst, trial.spin());
      return true;
    });
    sound = sound && trial.sound();
    spin = std::max(spin, worst);
    momentum = std::max(momentum, trial.momentum().norm());
    constexpr const char* kNames[] = {"scramble", "flatten", "100 x stretch"};
    found += text(" ", kNames[kind], " ", worst, ";");
  }
  return judged(sound, spin < 0.01 && momentum < 1e-6, spin,
                text("spin made out of none [rad/s]:", found, " momentum ", momentum, " kg m/s"));
}

Outcome over_damping(const Method& method, const Effort&) {
  const Decay result = decay(method, {1.0 / 30, 1.0 / 60, 1.0 / 240, 1.0 / 1000});
  return judged(result.sound, result.worst_error < 0.01, result.worst_error,
                text("energy kept in a step differs from 1/(1+(omega dt)^2) by ", 100 * result.worst_error,
                     " % at most, up to omega dt = ", result.fastest));
}

}  // namespace

std::vector<Row> integration_rows() {
  return {
      {10, "dt from 1/1000 to 1/15 s", "The scrambled cube for 3 s at seven time steps",
       "bounded, nothing inverted at any", Family::fem, time_steps, 6},
      {12, "CG cap hit, tolerance 1e-3",
       "The scrambled cube with caps of 5, 20 and 100 iterations at E = 1e5 and 1e9, and uncapped at 1e9",
       "bounded; centre of mass < 1 mm/s; capped solves are reported", Family::fem, capped_solver, 4},
      {13,
       "Indefinite or frozen tangent",
       "Ten times gravity on a slender cantilever (2 x 0.2 x 0.2 m, E = 1e6) in one step",
       "tip within two lengths, energy not above the load's work, nothing inverted after 4 s",
       Family::fem,
       sudden_load,
       2,
       {{"Newton inside a step", "exact tangent with line search; a static solve has it (crumple-lab solve)"}}},
      {14,
       "Angular momentum out of nothing",
       "Scrambled, flattened and 100 x stretched cube, all with L = 0",
       "spin |L|/I < 0.01 rad/s, momentum < 1e-6 kg m/s",
       Family::fem,
       angular_momentum,
       2,
       {{"momentum-conserving projection", "L kept by a projection or by iterating the step"}}},
      {15,
       "Over-damping by backward Euler",
       "Small free vibration in the lowest and the twelfth mode, dt = 1/30 to 1/1000 s",
       "energy kept in a step = 1/(1+(omega dt)^2) within 1 %",
       Family::fem,
       over_damping,
       1,
       {{"BDF2, TR-BDF2, exponential", "an integrator that damps less"}}},
  };
}

}  // namespace crumple::lab::stability
