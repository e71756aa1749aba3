#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/lab/stability/beam_and_modes.h"

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

// The worst of several trials of one row.
struct Worst {
  bool sound = true;
  int inverted = 0, tets = 0;
  double shape = 0;

  void add(const SoftTrial& trial) {
    sound = sound && trial.sound();
    inverted = std::max(inverted, trial.inverted());
    tets = trial.mesh.tet_count();
    shape = std::max(shape, trial.shape_error());
  }
  // Tets that stay inverted are the failure itself, whatever else is well.
  Outcome outcome(const std::string& more = "") const {
    if (!sound) return judged(false, false, tets, "not finite or unbounded" + more);
    const std::string found =
        text(inverted, " of ", tets, " tets stay inverted, shape error ", 100 * shape, " % of the side", more);
    if (inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
    return judged(true, shape < kRecovered, shape, found);
  }
};

void scramble(SoftTrial& trial, std::uint64_t seed, double low = 0, double high = 1) {
  Random random(seed);
  trial.deform([&](const Vec3&) { return random.vec3(low, high); });
}

Outcome inverted_elements(const Method& method, const Effort& effort) {
  const int cells = effort.brief ? 3 : 4, seeds = effort.brief ? 1 : 3;
  Worst worst;
  double kinetic_left = 0;
  for (int seed = 1; seed <= seeds + 1; ++seed) {
    SoftTrial trial(unit_cube(cells), soft_material(), method.fem);
    const bool wide = seed > seeds;
    scramble(trial, seed, wide ? -1 : 0, wide ? 2 : 1);
    trial.run(2, kDt);
    worst.add(trial);
    const double largest = trial.largest_kinetic;
    if (!trial.sound()) break;
    trial.run(effort.brief ? 2 : 8, kDt);
    worst.sound = worst.sound && trial.sound();
    kinetic_left = std::max(kinetic_left, trial.kinetic() / largest);
  }
  Outcome outcome =
      worst.outcome(text("; kinetic energy left after ", effort.brief ? 4 : 10, " s ", 100 * kinetic_left, " %"));
  if (outcome.verdict == Verdict::pass && kinetic_left > 0.05) outcome.verdict = Verdict::limit;
  return outcome;
}

Outcome reflection(const Method& method, const Effort& effort) {
  SoftTrial trial(unit_cube(effort.brief ? 3 : 4), soft_material(), method.fem);
  trial.deform([](const Vec3& X) { return Vec3(1 - X.x(), X.y(), X.z()); });
  trial.run(2, kDt);
  Worst worst;
  worst.add(trial);
  return worst.outcome();
}

Outcome collapse(const Method& method, const Effort& effort) {
  Worst worst;
  for (const double noise : {0.0, 1e-6})
    for (const Vec3& scale : {Vec3(1, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 0)}) {
      if (effort.brief && noise == 0) continue;
      SoftTrial trial(unit_cube(effort.brief ? 3 : 4), soft_material(), method.fem);
      Random random(5);
      trial.deform([&](const Vec3& X) -> Vec3 { return scale.cwiseProduct(X) + random.vec3(-noise, noise); });
      trial.run(2, kDt);
      worst.add(trial);
    }
  return worst.outcome();
}

double angle_between(const Mat3& Q, const Mat3& R) {
  return std::acos(std::clamp(((Q.transpose() * R).trace() - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

Outcome branch_jump(const Method& method, const Effort& effort) {
  // det F goes through 6 % by a thousandth a sample; Q of a continuous rule turns by a fraction of a degree.
  Random random(7);
  double jump = 0;
  for (int k = 0; k < (effort.brief ? 50 : 400); ++k) {
    Mat3 F;
    do F << random.vec3(-1, 1), random.vec3(-1, 1), random.vec3(-1, 1);
    while (F.determinant() < 0.05);
    F *= std::cbrt(0.0625 / F.determinant());
    Mat3 before = method.fem.rotation(F);
    for (int s = 0; s < 80; ++s) {
      F *= std::cbrt(0.999);
      const Mat3 Q = method.fem.rotation(F);
      jump = std::max(jump, angle_between(before, Q));
      before = Q;
    }
  }
  // Small steps make it worse: the branches feed energy faster than backward Euler takes it out.
  SoftTrial trial(unit_cube(3), soft_material(), method.fem);
  scramble(trial, 1);
  const double seconds = 2.5;
  trial.run(seconds, 1e-3);
  const int inverted = trial.sound() ? trial.inverted() : trial.mesh.tet_count();
  const std::string found =
      text("Q jumps by ", jump, " degrees while det F falls by 0.1 %; scrambled cube at dt = 1 ms: ", inverted, " of ",
           trial.mesh.tet_count(), " tets inverted after ", seconds, " s");
  if (trial.sound() && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(trial.sound(), jump < 5, jump, found);
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
  trial.run(effort.brief ? 5 : 20, kDt);
  const double left = trial.energy() / start, gained = trial.largest_energy / start;
  const int inverted = trial.inverted();
  const std::string found = text("energy left ", left, " of the start's, never above ", gained, " of it; ", inverted,
                                 " inverted, spin ", trial.spin(), " rad/s");
  if (trial.sound() && inverted > 0) return {Verdict::fails, static_cast<double>(inverted), found};
  return judged(trial.sound(), gained < 1 + 1e-9 && left < 1e-3, left, found);
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
  const std::string found =
      text(broken.empty() ? "every scramble recovers" : "scramble does not recover at nu =" + broken,
           "; tip of a slender beam over beam theory, nu:", locking);
  if (sound && !broken.empty()) return {Verdict::fails, 1, found};
  return judged(sound, worst < 0.2, worst, found);
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
  found = text("scrambled cube with a tet squashed to", found, " shape error ", 100 * shape, " %");
  if (sound && !refused) return {Verdict::fails, 1, found};
  return judged(sound, left == 0, left, found);
}

}  // namespace

std::vector<Row> element_rows() {
  return {
      {1, "Inverted elements",
       "Cube of 4^3 x 6 tets, every vertex random in its box (three seeds) and in three times its box; E = 1e5, nu = "
       "0.3, dt = 1/60 s",
       "0 inverted and shape error < 1 % within 120 steps, then kinetic energy to 0", Family::fem, inverted_elements,
       6},
      {2, "Reflection taken for rest (det Q < 0)", "The cube mirrored, x to 1 - x",
       "un-mirrors: 0 inverted, shape error < 1 %", Family::fem, reflection, 0.7},
      {3, "Collapse to a plane, a line, a point", "X diag(1,1,0), (1,0,0), 0, exact and with 1e-6 m of noise",
       "as row 1", Family::fem, collapse, 3},
      {4, "Jump between polar and QR at 6 % volume",
       "det F swept through 0.06 for 400 random F; a scrambled cube at dt = 1/1000 s for 2.5 s",
       "Q turns by < 5 degrees a sample; nothing stays inverted", Family::fem, branch_jump, 5},
      {5, "QR bias, ghost torque", "A block squeezed to 4 % of its volume and released, in 24 orientations",
       "the result turns with the block within 5 %; spin is reported", Family::fem, ghost_torque, 1},
      {6, "90 % compression and release", "Plates squeeze the cube to 10 % in a second and open in a second",
       "shape back within 1 %", Family::fem, compression, 2},
      {7, "100 x stretch and release", "X diag(100,1,1), 20 s",
       "nothing inverted, energy never above the start's and < 0.1 % of it at the end", Family::fem, stretch, 4},
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
       "The scrambled cube, nu = 0.3 to 0.4999; a slender beam's tip over beam theory (1: no locking)",
       "bounded, nothing inverted; locking below 20 %",
       Family::fem,
       incompressibility,
       3,
       {{"mixed u-p or F-bar elements", "an element that does not lock"},
        {"quadratic tets", "an element that does not lock"}}},
      {11, "Slivers", "The scrambled cube with one tet squashed to 1e-4, 1e-8, 0 and -0.1 of its height",
       "zero and negative volume refused at load; else as row 1 without inversion", Family::fem, slivers, 2},
  };
}

}  // namespace crumple::lab::stability
