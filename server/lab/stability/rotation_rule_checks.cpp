#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/fem/corotational.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>

// Rows about the rule that factors Q out of F: its jumps, and its bias towards the axes.
namespace crumple::lab::stability {
namespace {

constexpr double kDt = 1.0 / 60;  // [s]

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

}  // namespace

std::vector<Row> rotation_rule_rows() {
  return {
      {4, "Jump between polar and QR at 6 % volume",
       "det F swept through 0.06 for 400 random F; a cube squeezed to 0.39^3 or flat to 6 % and let go, and pressed "
       "from 12 "
       "% to 3 % in 2 s; a scrambled cube at dt = 1/1000 s for 2.5 s",
       "Q turns by < 5 degrees a sample and switches < 5 times a second and tet, energy does not rise; nothing stays "
       "inverted",
       Family::fem, branch_jump, 6},
      {5, "QR bias, ghost torque", "A block squeezed to 4 % of its volume and released, in 24 orientations",
       "the result turns with the block within 5 %; spin is reported", Family::fem, ghost_torque, 1},
  };
}

}  // namespace crumple::lab::stability
