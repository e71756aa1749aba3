#include "common/text.h"
#include "server/lab/stability/beam_and_modes.h"
#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/newton_statics.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"

#include <algorithm>
#include <cmath>
#include <memory>

// Rows about the integrator and the solver of one body.
namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;

constexpr double kDt = 1.0 / 60;  // [s]

// Energy kept per step by a small oscillation of a mode, against the formula of the method's integrator.
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
      const double kept = std::pow(trial.energy() / before, 1.0 / n);
      const ModeState mode_then = mode_after(method.fem.integrator, h * h, 0, {0, 1}, 1, n);
      const double expected = std::pow(mode_then.v * mode_then.v + h * h * mode_then.q * mode_then.q, 1.0 / n);
      result.sound = result.sound && trial.sound();
      result.fastest = std::max(result.fastest, h);
      result.worst_error = std::max(result.worst_error, std::abs(kept - expected) / expected);
    }
  }
  return result;
}

// The yardstick's S12: a beam of 1 x 0.1 x 0.1 m, 240 tets, E = 1e6 Pa, held at x = 0, from rest under gravity along z.
std::unique_ptr<SoftTrial> swing(const FemMethod& method, double gravity) {
  FemMaterial material;
  material.young = 1e6;
  auto beam = std::make_unique<SoftTrial>(block({1, 0.1, 0.1}, {10, 2, 2}), material, method);
  for (int i = 0; i < beam->mesh.node_count(); ++i) {
    if (beam->mesh.X[i].x() == 0) beam->prescribed.push_back({i, Vec3::Zero()});
    beam->force(3 * i + 2) = -gravity * beam->rest.node_mass[i];
  }
  return beam;
}

// Largest energy of a run over the work that the trial's forces did on the way to it.
double energy_over_work(SoftTrial& trial, double seconds, double dt) {
  double work = 0, gained = 0;
  std::vector<Vec3> before = trial.state.x;
  trial.run(seconds, dt, [&] {
    for (int i = 0; i < trial.mesh.node_count(); ++i)
      work += trial.force.segment<3>(3 * i).dot(trial.state.x[i] - before[i]);
    before = trial.state.x;
    // The work ends where it began in each swing; what is compared must not be rounding.
    if (work > 1e-3 * trial.rest.mass()) gained = std::max(gained, trial.energy() / work);
    return true;
  });
  return gained;
}

// A stack of three cubes of 1 m for two seconds. Of methods that a scene can ask for: the others know no contact.
bool stack_stands(const Method& method, double dt) {
  ContactMethod contact;
  contact.material = method.fem.choose;
  contact.integrator = method.fem.integrator;
  contact.element = method.fem.element;
  ContactTrial trial(contact, dt);
  trial.scene.float_solver = method.fem.float_matrix;
  trial.scene.solver = method.fem.solver;
  trial.solver_tolerance = 1e-3;
  trial.add_ground();
  for (int k = 0; k < 3; ++k) trial.add_block({.centre = {0, 0.5 + k, 0}, .young = 1e7});
  trial.start();
  trial.run(2);
  return trial.sound() && trial.inverted() == 0 && trial.lowest(trial.blocks[2]) > 1.8 &&
         trial.rms_speed(trial.blocks[2]) < 0.1;
}

Outcome time_steps(const Method& method, const Effort& effort) {
  std::string broken, fallen, wild;
  bool sound = true;
  int inverted = 0;
  double swung = 0, error = 0;
  const bool stacks = method.standing != Standing::comparison;
  for (const double rate : {1000.0, 480.0, 240.0, 120.0, 60.0, 30.0, 15.0}) {
    if (effort.brief && (rate == 480 || rate == 120 || rate == 30)) continue;
    const double dt = 1 / rate;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), soft_material(), method.fem);
    Random random(1);
    trial.deform([&](const Vec3&) { return random.vec3(0, 1); });
    trial.run(3, dt);
    const bool finite = trial.sound();
    const int left = finite ? trial.inverted() : trial.mesh.tet_count();
    if (left > 0) broken += text(" 1/", rate, finite ? "" : " (not finite)");
    inverted = std::max(inverted, left);

    const auto held = swing(method.fem, 9.81);
    SoftTrial& beam = *held;
    const double gained = energy_over_work(beam, effort.brief ? 0.5 : 1, dt);
    if (!beam.sound() || gained > 1.01) wild += text(" 1/", rate, beam.sound() ? "" : " (not finite)");
    swung = std::max(swung, gained);
    const Decay small = decay(method, {dt});
    error = std::max(error, small.worst_error);
    sound = sound && finite && beam.sound() && small.sound;
    if (stacks && !(effort.brief && rate == 1000) && !stack_stands(method, dt)) fallen += text(" 1/", rate);
  }
  const std::string found =
      text(broken.empty() ? "recovers at every dt from 1/1000 to 1/15 s" : "does not recover at dt =" + broken + " s",
           wild.empty() ? "; S12's swing never has more energy than gravity gave it"
                        : "; S12's swing has more energy than gravity gave it at dt =" + wild + " s",
           " (", swung, " of it); decay off its formula by ", 100 * error, " % at most",
           !stacks          ? "; knows no contact, so no stack"
           : fallen.empty() ? "; a stack of three stands at every dt"
                            : "; a stack of three does not stand at dt =" + fallen + " s");
  if (sound && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(sound, swung < 1.01 && error < 0.01 && fallen.empty(), std::max(error, swung - 1), found);
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
      // A solve that misses its tolerance says so, and no other.
      flagged = flagged && (trial.capped > 0) == (trial.worst_residual > trial.rest.material.cg_tolerance);
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

  // A body that flies freely: the last velocity is the answer, a warm start finds that out without an iteration.
  SoftTrial flying(unit_cube(effort.brief ? 2 : 4), material, method.fem);
  for (Vec3& v : flying.state.v) v = Vec3(1, 2, 3);
  const int warm = method.fem.step(flying, kDt).iterations;
  const bool warm_started = !method.fem.iterates || warm == 0;
  return judged(
      sound, com < 1e-3 && flagged && warm_started, com,
      text("centre of mass drifts at ", com, " m/s at most (E = 1e9, tolerance 1e-3: ", resting, ")",
           method.fem.iterates ? text("; a step of a body in free flight takes ", warm, " iterations;", found) : ""));
}

Outcome sudden_load(const Method& method, const Effort& effort) {
  const auto beam = elastica(method.fem, 10);
  SoftTrial& trial = *beam;
  double reach = 0, work = 0, gained = 0;
  std::vector<Vec3> before = trial.state.x;
  trial.run(effort.brief ? 1 : 4, kDt, [&] {
    for (int i = 0; i < trial.mesh.node_count(); ++i) {
      reach = std::max(reach, trial.state.x[i].norm());
      work += trial.force.segment<3>(3 * i).dot(trial.state.x[i] - before[i]);
    }
    before = trial.state.x;
    if (work > 0) gained = std::max(gained, trial.energy() / work);
    return true;
  });
  const int inverted = trial.inverted();
  std::string newtons;
  // What the rotation rule makes of statics; the same whatever solves the steps.
  if (!effort.brief && method.fem.iterates && method.standing != Standing::comparison && !method.fem.float_matrix)
    for (const auto& [name, tangent] :
         {std::pair{"frozen", sim::fem::Tangent::fixed_rotation}, {"exact", sim::fem::Tangent::exact}})
      for (const double times : {1.0, 10.0}) {
        const NewtonRun run = newton(*elastica(method.fem, times), tangent);
        newtons += text(" ", name, " tangent, ", times, " times the load: ",
                        run.converged ? text(run.iterations, " iterations;")
                                      : text("residual ", run.residual, " after ", run.iterations, ";"));
      }
  return judged(trial.sound(), reach < 2 && gained < 1.01 && inverted == 0, gained,
                text("farthest point ", reach, " m from the root of a beam of 1 m; energy never above ", gained,
                     " of the load's work; at the end ", inverted, " inverted, rms speed ",
                     std::sqrt(2 * trial.kinetic() / trial.rest.mass()), " m/s",
                     newtons.empty() ? "" : ". Static Newton from rest, full steps, the core's rotation:" + newtons));
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
    double worst = 0, moved = 0;
    trial.run(2, kDt, [&] {
      worst = std::max(worst, trial.spin());
      moved = std::max(moved, trial.momentum().norm());
      return true;
    });
    sound = sound && trial.sound();
    spin = std::max(spin, worst);
    // Over what the nodes have at their fastest.
    momentum = std::max(momentum, moved / std::sqrt(2 * trial.rest.mass() * trial.largest_kinetic));
    constexpr const char* kNames[] = {"scramble", "flatten", "100 x stretch"};
    found += text(" ", kNames[kind], " ", worst, ";");
  }
  return judged(
      sound, spin < 0.01 && momentum < 1e-10, spin,
      text("spin made out of none [rad/s]:", found, " momentum out of none: ", momentum, " of what the nodes have"));
}

Outcome over_damping(const Method& method, const Effort& effort) {
  const Decay result = decay(method, {1.0 / 30, 1.0 / 60, 1.0 / 240, 1.0 / 1000});
  // S12's beam in so little gravity that it stays linear: a second of its swing, all modes at once.
  double error = 0;
  std::string swings;
  bool sound = result.sound;
  for (const double rate : {60.0, 240.0}) {
    if (effort.brief && rate == 240) continue;
    const auto held = swing(method.fem, 1e-4);
    SoftTrial& beam = *held;
    const int steps = static_cast<int>(rate);
    beam.run(1, 1 / rate);
    const double expected = energy_by_modes(beam, 1 / rate, steps), kept = beam.energy();
    sound = sound && beam.sound();
    error = std::max(error, std::abs(kept / expected - 1));
    swings += text(" ", 100 * (kept / expected - 1), " % at dt = 1/", rate, ";");
  }
  return judged(sound, result.worst_error < 0.01 && error < 0.01, std::max(result.worst_error, error),
                text("energy kept in a step differs from the integrator's formula by ", 100 * result.worst_error,
                     " % at most, up to omega dt = ", result.fastest,
                     "; energy after a second of a small swing of S12 against its modes':", swings));
}

}  // namespace

std::vector<Row> integration_rows() {
  return {
      {10, "dt from 1/1000 to 1/15 s",
       "The scrambled cube for 3 s, S12's swing for 1 s, small vibration and a stack of three for 2 s, at seven time "
       "steps",
       "bounded, nothing inverted, energy of the swing within 1 % of gravity's work, decay = 1/(1+(omega dt)^2) within "
       "1 "
       "%, the stack stands",
       Family::fem, time_steps, 12},
      {12, "CG cap hit, tolerance 1e-3",
       "The scrambled cube with caps of 5, 20 and 100 iterations at E = 1e5 and 1e9, and uncapped at 1e9; free flight",
       "bounded; centre of mass < 1 mm/s; capped solves are reported; solves start from the last velocity", Family::fem,
       capped_solver, 4},
      {13,
       "Indefinite or frozen tangent",
       "Ten times S04's dead load on its cantilever (1 x 0.1 x 0.1 m, 1667 N) in one step; its static equilibrium by "
       "Newton",
       "no point beyond two lengths, energy not above the load's work, nothing inverted after 4 s",
       Family::fem,
       sudden_load,
       4,
       {{"Newton inside a step", "exact tangent with line search; a static solve has it (crumple-lab solve)"}}},
      {14,
       "Angular momentum out of nothing",
       "Scrambled, flattened and 100 x stretched cube, all with L = 0",
       "spin |L|/I < 0.01 rad/s, momentum < 1e-10 of the nodes' own",
       Family::fem,
       angular_momentum,
       2,
       {{"momentum-conserving projection", "L kept by a projection or by iterating the step"}}},
      {15,
       "Over-damping by backward Euler",
       "Small free vibration in the lowest and the twelfth mode, dt = 1/30 to 1/1000 s; a small swing of S12's beam "
       "for 1 s",
       "energy kept in a step as the integrator's formula says (backward Euler: 1/(1+(omega dt)^2)) within 1 %, energy of the "
       "swing = that of its modes within 1 %",
       Family::fem,
       over_damping,
       1,
       {{"TR-BDF2, exponential", "integrators that damp less than BDF2"}}},
  };
}

}  // namespace crumple::lab::stability
