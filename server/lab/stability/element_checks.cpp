#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/lab/stability/beam_and_modes.h"
#include "server/lab/stability/stored_mesh.h"
#include "server/sim/fem/corotational.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>

// Rows about single elements: inversion, collapse, jumps of the rotation, extreme materials and shapes.
namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;

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

void scramble(SoftTrial& trial, std::uint64_t seed, double low = 0, double high = 1) {
  Random random(seed);
  trial.deform([&](const Vec3&) { return random.vec3(low, high); });
}

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

double angle_between(const Mat3& Q, const Mat3& R) {
  return std::acos(std::clamp(((Q.transpose() * R).trace() - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

// How often Q of a tet turns by more than 30 degrees in a step, in the last second of a run.
class Switches {
 public:
  explicit Switches(const SoftTrial& trial) : trial_(trial) { look(before_); }
  void count(bool judged) {
    look(now_);
    for (std::size_t t = 0; judged && t < now_.size(); ++t) switches_ += angle_between(before_[t], now_[t]) > 30;
    std::swap(before_, now_);
  }
  double a_tet() const { return static_cast<double>(switches_) / static_cast<double>(before_.size()); }

 private:
  void look(std::vector<Mat3>& Q) const {
    Q.clear();
    for (int t = 0; t < trial_.mesh.tet_count(); ++t)
      Q.push_back(trial_.method.rotation(
          sim::fem::deformation_gradient(sim::fem::gather(trial_.state.x, trial_.mesh.tets[t]), trial_.rest.beta[t])));
  }
  const SoftTrial& trial_;
  std::vector<Mat3> before_, now_;
  long switches_ = 0;
};

struct Chatter {
  bool sound = true;
  double switches = 0;  // a tet, in a second
  double gained = 0;    // largest energy over the start's
};

// A cube squeezed evenly to 0.39^3, or flat to 6 %, and let go for two seconds; or pressed slowly from 12 % to 3 % of
// its height by plates within two seconds, so that every tet goes through 6 %.
Chatter through_six_percent(const Method& method, const Effort& effort, const Vec3& squeeze, bool plates) {
  SoftTrial trial(unit_cube(effort.brief ? 2 : 3), soft_material(), method.fem);
  trial.deform([&](const Vec3& X) -> Vec3 { return squeeze.cwiseProduct(X); });
  if (plates)
    for (int i = 0; i < trial.mesh.node_count(); ++i) {
      if (trial.mesh.X[i].y() == 0) trial.prescribed.push_back({i, Vec3::Zero()});
      if (trial.mesh.X[i].y() == 1) trial.prescribed.push_back({i, Vec3(0, (0.03 - squeeze.y()) / 2, 0)});
    }
  Switches switches(trial);
  const double start = trial.energy();
  int step = 0;
  trial.run(2, kDt, [&] {
    switches.count(++step > 60);
    return true;
  });
  return {trial.sound(), switches.a_tet(), plates ? 0 : trial.largest_energy / start};
}

Outcome branch_jump(const Method& method, const Effort& effort) {
  // det F goes through 6 % by a thousandth a sample; Q of a continuous rule turns by a fraction of a degree. f goes
  // with Q: |f| is what a turned Q makes of the same F.
  Random random(7);
  double jump = 0, force_jump = 0;
  const sim::fem::Lame lame = sim::fem::lame_constants(1e5, 0.3);
  const auto stress = [&](const Mat3& F, const Mat3& Q) -> Mat3 {
    return sim::fem::first_piola(lame, Q, F, Mat3::Zero());
  };
  for (int k = 0; k < (effort.brief ? 50 : 400); ++k) {
    Mat3 F;
    do F << random.vec3(-1, 1), random.vec3(-1, 1), random.vec3(-1, 1);
    while (F.determinant() < 0.05);
    F *= std::cbrt(0.0625 / F.determinant());
    Mat3 before = method.fem.rotation(F), P = stress(F, before);
    for (int s = 0; s < 80; ++s) {
      F *= std::cbrt(0.999);
      const Mat3 Q = method.fem.rotation(F), now = stress(F, Q);
      jump = std::max(jump, angle_between(before, Q));
      force_jump = std::max(force_jump, (now - P).norm() / P.norm());
      before = Q;
      P = now;
    }
  }
  // Small steps make it worse: the branches feed energy faster than backward Euler takes it out.
  SoftTrial trial(unit_cube(3), soft_material(), method.fem);
  scramble(trial, 1);
  const double seconds = 2.5;
  trial.run(seconds, 1e-3);
  const int inverted = trial.sound() ? trial.inverted() : trial.mesh.tet_count();
  bool sound = trial.sound();

  double switches = 0, gained = 0;
  for (const auto& [squeeze, plates] :
       {std::pair<Vec3, bool>{Vec3::Constant(0.39), false}, {Vec3(1, 0.06, 1), false}, {Vec3(1, 0.12, 1), true}}) {
    const Chatter chatter = through_six_percent(method, effort, squeeze, plates);
    sound = sound && chatter.sound;
    switches = std::max(switches, chatter.switches);
    gained = std::max(gained, chatter.gained);
  }
  const std::string found =
      text("Q jumps by ", jump, " degrees and the stress by ", 100 * force_jump,
           " % while det F falls by 0.1 %; squeezed to 0.39^3, to 6 % and pressed through 6 %, Q of a tet switches ",
           switches, " times a second and the energy is never above ", gained,
           " of the start's; scrambled cube at dt = 1 ms: ", inverted, " of ", trial.mesh.tet_count(),
           " tets inverted after ", seconds, " s");
  if (sound && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(sound, jump < 5 && switches < 5 && gained < 1 + 1e-6, jump, found);
}

// The 24 rotations that take the axes to the axes.
std::vector<Mat3> cube_rotations() {
  std::vector<Mat3> all;
  for (int a = 0; a < 6; ++a)
    for (int turn = 0; turn < 4; ++turn) {
      const Vec3 axis = Vec3::Unit(a / 2) * (a % 2 ? -1 : 1);
      const Quat to = Quat::FromTwoVectors(Vec3::UnitX(), axis);
      all.push_back((to * Quat(Eigen::AngleAxisd(turn * std::numbers::pi / 2, Vec3::UnitX()))).toRotationMatrix());
    }
  return all;
}

Outcome ghost_torque(const Method& method, const Effort& effort) {
  std::vector<Vec3> reference;
  double difference = 0, spin = 0;
  bool sound = true;
  for (const Mat3& R : cube_rotations()) {
    // The block itself is turned, rest shape and all: rules that look at columns of F see other columns.
    sim::TetMesh mesh = unit_cube(2);
    for (Vec3& X : mesh.X) X = R * X;
    SoftTrial trial(mesh, soft_material(), method.fem);
    trial.deform([&](const Vec3& X_turned) -> Vec3 {
      const Vec3 X = R.transpose() * X_turned;
      return R * Vec3(0.04 * X.x() + 0.1 * X.y(), X.y(), X.z() + 0.1 * X.x());
    });
    trial.run(0.25, kDt);
    sound = sound && trial.sound();
    spin = std::max(spin, trial.spin());
    if (reference.empty()) {
      for (const Vec3& x : trial.state.x) reference.push_back(R.transpose() * x);
    }
    for (std::size_t i = 0; i < reference.size(); ++i)
      difference = std::max(difference, (R.transpose() * trial.state.x[i] - reference[i]).norm());
    if (effort.brief && difference > 0.5) break;
  }
  return judged(sound, difference < 0.05, difference,
                text("a block squeezed to 4 % in 24 orientations opens ", 100 * difference,
                     " % of its side differently; spin up to ", spin, " rad/s"));
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

Outcome stiffness(const Method& method, const Effort& effort) {
  double worst_residual = 0, highest = 0;
  bool sound = true;
  int capped = 0;
  std::string broken;
  for (double young = 1e3; young < 2e11; young *= effort.brief ? 1e4 : 10) {
    FemMaterial material = soft_material();
    material.young = young;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), material, method.fem);
    scramble(trial, 2);
    trial.run(std::max(2.0, 10 * std::sqrt(material.density / young)), kDt);  // ten times that a wave needs through it
    const bool well = trial.sound() && trial.inverted() == 0;
    if (well)
      highest = young;
    else
      broken += text(" ", young);
    sound = sound && trial.sound();
    if (trial.sound()) worst_residual = std::max(worst_residual, trial.worst_residual);
    capped += trial.capped;
  }
  const std::string found = text("recovers up to E = ", highest, " Pa", broken.empty() ? "" : "; not at E =" + broken,
                                 "; worst residual ", worst_residual, ", ", capped, " capped solves");
  if (sound && !broken.empty()) return {Verdict::fails, 1, found};
  return judged(sound, capped == 0, capped, found);
}

Outcome incompressibility(const Method& method, const Effort& effort) {
  std::string broken, locking;
  bool sound = true;
  double worst = 0;
  for (const double nu : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
    FemMaterial material = soft_material();
    material.poisson = nu;
    SoftTrial trial(unit_cube(effort.brief ? 2 : 3), material, method.fem);
    scramble(trial, 3);
    trial.run(2, kDt);
    sound = sound && trial.sound();
    if (!trial.sound() || trial.inverted() > 0) broken += text(" ", nu);
    const double ratio = cantilever_ratio(nu);
    worst = std::max(worst, 1 - ratio);
    locking += text(" ", nu, ": ", ratio);
  }
  std::string cook;
  for (const double nu : {0.3, 0.49, 0.4999}) {
    const double ratio = cook_ratio(nu, effort.brief ? 8 : 16);
    worst = std::max(worst, 1 - ratio);
    cook += text(" ", nu, ": ", cook_ratio(nu, 8), effort.brief ? "" : text(" and ", ratio));
  }
  const std::string found =
      text(broken.empty() ? "every scramble recovers" : "scramble does not recover at nu =" + broken,
           "; Cook's membrane over quadratic tets, 8", effort.brief ? "" : " and 16", " cells across, nu:", cook,
           "; tip of a slender beam over beam theory, nu:", locking);
  if (sound && !broken.empty()) return {Verdict::fails, 1, found};
  return judged(sound, worst < 0.2, worst, found);
}

// Part of its spin that a plate of 1 m x 1 cm, E = 1e9, turning about a diameter at 10 rad/s, has after a step: its
// tets are clamped.
double spin_kept_by_thin_plate(const FemMethod& method) {
  FemMaterial material;
  material.young = 1e9;
  SoftTrial plate(block({1, 0.01, 1}, {4, 1, 4}), material, method);
  const Vec3 middle = plate.centre();
  for (int i = 0; i < plate.mesh.node_count(); ++i)
    plate.state.v[i] = Vec3(10, 0, 0).cross(Vec3(plate.mesh.X[i] - middle));
  const double before = plate.spin();
  method.step(plate, kDt);
  return plate.spin() / before;
}

Outcome slivers(const Method& method, const Effort& effort) {
  std::string found;
  bool sound = true, refused = true;
  double shape = 0;
  int left = 0;
  for (const double quality : {1e-4, 1e-8, 0.0, -0.1}) {
    const sim::TetMesh mesh = cube_with_sliver(3, quality);
    if (!sim::validate(mesh, "mesh")) {
      found += text(" ", quality, ": refused at load;");
      refused = refused && quality <= 0;
      continue;
    }
    refused = refused && quality > 0;
    SoftTrial trial(mesh, soft_material(), method.fem);
    scramble(trial, 1);
    trial.run(effort.brief ? 1 : 4, kDt);
    sound = sound && trial.sound();
    const int inverted = trial.inverted();
    left = std::max(left, inverted);
    shape = std::max(shape, trial.shape_error());
    found += text(" ", quality, ": ", inverted, " inverted;");
  }
  // What keeps slivers from being stiff, the clamp of the basis matrices, against a turn: with Q frozen in a step a
  // clamped tet's force is not blind to it.
  const double kept = spin_kept_by_thin_plate(method.fem);
  found = text("scrambled cube with a tet squashed to", found, " shape error ", 100 * shape,
               " %; the bunny (S09 L0, 6V/L^3 = 9.4e-4) ");
  if (const auto bunny = stored_mesh(effort.references / "S09_bunny_hung" / "L0.json")) {
    FemMaterial material = soft_material();
    material.young = 2e5;
    material.poisson = 0.35;
    SoftTrial trial(*bunny, material, method.fem);
    Eigen::AlignedBox3d box;
    for (const Vec3& X : bunny->X) box.extend(X);
    Random random(1);
    trial.deform([&](const Vec3&) -> Vec3 { return box.min() + random.vec3(0, 1).cwiseProduct(box.sizes()); });
    trial.run(2, kDt);
    sound = sound && trial.sound();
    const int inverted = trial.sound() ? trial.inverted() : trial.mesh.tet_count();
    left = std::max(left, inverted);
    found += text("scrambled: ", inverted, " of ", trial.mesh.tet_count(), " inverted");
  } else {
    found += effort.brief ? "is left to the full run" : "is not at hand";
  }
  found += text("; a thin plate with clamped tets (1 m x 1 cm, E = 1e9, 10 rad/s) keeps ", 100 * kept,
                " % of its spin in a step");
  if (sound && !refused) return {Verdict::fails, 1, found};
  return judged(sound, left == 0, left, found);
}

}  // namespace

std::vector<Row> element_rows() {
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
      {4, "Jump between polar and QR at 6 % volume",
       "det F swept through 0.06 for 400 random F; a cube squeezed to 0.39^3 or flat to 6 % and let go, and pressed "
       "from 12 "
       "% to 3 % in 2 s; a scrambled cube at dt = 1/1000 s for 2.5 s",
       "Q turns by < 5 degrees a sample and switches < 5 times a second and tet, energy does not rise; nothing stays "
       "inverted",
       Family::fem, branch_jump, 6},
      {5, "QR bias, ghost torque", "A block squeezed to 4 % of its volume and released, in 24 orientations",
       "the result turns with the block within 5 %; spin is reported", Family::fem, ghost_torque, 1},
      {6, "90 % compression and release", "Plates squeeze the cube to 10 % in a second and open in a second",
       "shape back within 1 %", Family::fem, compression, 2},
      {7, "100 x stretch and release", "X diag(100,1,1), 20 s",
       "nothing inverted, shape error < 1 % and energy < 0.1 % of the start's at the end, never above it; no node "
       "faster "
       "than all of the energy could make it",
       Family::fem, stretch, 4},
      {8,
       "Stiffness",
       "The scrambled cube, E = 1e3 to 1e11 Pa, dt = 1/60 s, for ten passes of a wave",
       "bounded, nothing inverted, no solve ends at its cap",
       Family::fem,
       stiffness,
       4,
       {{"float32 alarm", "a warning where float_solver meets a condition number above 1e6"}}},
      {9,
       "nu towards 0.5",
       "The scrambled cube, nu = 0.3 to 0.4999; Cook's membrane (S10) over quadratic tets and a slender beam's tip "
       "over "
       "beam theory (1: no locking)",
       "bounded, nothing inverted; locking below 20 %",
       Family::fem,
       incompressibility,
       3,
       {{"mixed u-p or F-bar elements", "an element that does not lock"},
        {"quadratic tets", "an element that does not lock"}}},
      {11, "Slivers",
       "The scrambled cube with one tet squashed to 1e-4, 1e-8, 0 and -0.1 of its height; the bunny (S09 L0) scrambled",
       "zero and negative volume refused at load; else bounded, and nothing inverted; what clamping does to a turn is "
       "reported",
       Family::fem, slivers, 15},
  };
}

}  // namespace crumple::lab::stability
