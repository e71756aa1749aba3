#include "common/text.h"
#include "server/authoring/barrel_asset.h"
#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/handle_weights.h"
#include "server/lab/stability/example_trial.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/example_based/impulse_projection.h"
#include "server/sim/example_based/skinning.h"
#include "server/sim/example_based/weights.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cmath>
#include <limits>

// Rows about example-based deformation.
namespace crumple::lab::stability {
namespace {

using namespace sim::example_based;

constexpr double kSimplex = 1e-12;  // rounding of a row's sum
constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

Outcome strong_and_narrow(const Method& method, const Effort& effort) {
  ExampleTrial trial(bar_set(usual_poses()), method.example);
  trial.parameters.alpha *= 100;
  trial.parameters.gamma = 1.01 * trial.shortest_edge();
  const Battered result = batter(trial, 200, effort.brief ? 30 : 100);
  return judged(result.finite && result.simplex_error < 1e-9,
                result.simplex_error < kSimplex && result.inverted == 0 && result.intersections == 0,
                result.inverted + result.intersections,
                text(result.inverted, " of ", trial.rest.set->mesh.tet_count(), " tets of the skin inverted, ",
                     result.intersections, " pairs of its triangles cut each other, strongest move ", result.jump,
                     " m in a step; rows of E sum to 1 within ", result.simplex_error));
}

// A set whose quaternions are stored with signs at random: the same poses.
std::shared_ptr<ExampleSet> with_random_signs(const ExampleSet& set, Random& random) {
  auto flipped = std::make_shared<ExampleSet>(set);
  for (Example& example : flipped->examples)
    for (BoneTransform& bone : example.bones)
      if (random.uniform(0, 1) < 0.5) bone.q.coeffs() *= -1;
  return flipped;
}

Outcome large_turns(const Method& method, const Effort& effort) {
  constexpr int kSamples = 1000;  // of E from 0 to 1
  double jump = 0, sign_error = 0;
  bool finite = true;
  std::string found;
  Random random(4);
  for (const double degrees : {90.0, 180.0, 270.0, 350.0, 359.0, 540.0}) {
    const auto set = bar_set({end_turned(degrees)});
    const ExampleTrial trial(set, method.example);
    const int vertex = trial.rest.vertex_count() - 1;
    const auto place = [vertex](const ExampleTrial& of, double E) {
      return skin_vertex(of.rest, vertex, Eigen::Vector2d(1 - E, E));
    };
    // What is not continuous is left when a smooth path's own move, the same before and after, is taken out.
    double worst = 0, move = 0;
    for (int k = 1; k < kSamples; ++k) {
      const double E = static_cast<double>(k) / kSamples, h = 1.0 / kSamples;
      const Vec3 before = place(trial, E - h), x = place(trial, E), after = place(trial, E + h);
      finite = finite && before.allFinite() && x.allFinite() && after.allFinite();
      worst = std::max(worst, (after - 2 * x + before).norm());
      move = std::max(move, (after - x).norm());
    }
    for (int flips = 0; flips < (effort.brief ? 2 : 8); ++flips) {
      const ExampleTrial other(with_random_signs(*set, random), method.example);
      for (int k = 0; k <= kSamples; k += 10) {
        const double E = static_cast<double>(k) / kSamples;
        const Vec3 x = place(other, E);
        finite = finite && x.allFinite();
        sign_error = std::max(sign_error, (place(trial, E) - x).norm());
      }
    }
    jump = std::max(jump, worst);
    found += text(" ", degrees, ": ", 1000 * worst, " (moves ", 1000 * move, ");");
  }
  return judged(finite, jump < 1e-3 && sign_error < 1e-9, std::max(jump, sign_error),
                text("jump of a corner [mm] within 0.001 of E, examples at", found,
                     " stored with other signs it differs by ", sign_error, " m"));
}

Outcome orthogonal(const Method& method, const Effort&) {
  ExampleTrial trial(bar_set(usual_poses()), method.example);
  double leak = 0, least = std::numeric_limits<double>::infinity(), most = 0;
  bool finite = true;
  for (const double scale : {1e-3, 1.0, 1e3}) {
    Jacobian J = scale * (Jacobian(3, 3) << 0.3, -0.1, 0.2, 0.1, 0.4, -0.2, 0, 0, 0).finished();
    // Units: alpha of eq. 8 in 1/m and of eq. 10 in 1/m^2 scale with the scene.
    ExampleParameters parameters = trial.parameters;
    if (parameters.step == ExampleParameters::Step::equation8) parameters.alpha /= scale;
    if (parameters.step == ExampleParameters::Step::equation10) parameters.alpha /= scale * scale;
    const WeightRow zero = weight_change(parameters, J, Vec3(0, 0, 0.01 * scale));
    const WeightRow moved = weight_change(parameters, J, Vec3(1e-5 * scale, 0, 0));
    finite = finite && zero.allFinite() && moved.allFinite();
    leak = std::max(leak, zero.norm());
    least = std::min(least, moved.norm());
    most = std::max(most, moved.norm());
  }
  const bool scale_free = most <= (1 + 1e-6) * least;
  return judged(finite, leak == 0 && scale_free, scale_free ? leak : 1,
                text("perpendicular impulse: |de| = ", leak,
                     "; a displacement of 1e-5 sizes at scales 1e-3, 1, 1e3 gives |de| from ", least, " to ", most));
}

Outcome over_complete(const Method& method, const Effort& effort) {
  double simplex = 0, difference = 0;
  bool finite = true;
  int inverted = 0;
  for (const int count : {3, 6, 20}) {
    std::vector<Pose3> poses;
    for (int k = 0; k < count - 1; ++k) poses.push_back(usual_poses()[k / 2 % 3]);  // each twice
    ExampleTrial trial(bar_set(poses), method.example);
    const Battered result = batter(trial, 100, effort.brief ? 10 : 40);
    finite = finite && result.finite;
    simplex = std::max(simplex, result.simplex_error);
    inverted = std::max(inverted, result.inverted);
    for (int e = 1; e + 1 < count; e += 2)
      difference = std::max(difference, (trial.state.E.col(e) - trial.state.E.col(e + 1)).cwiseAbs().maxCoeff());
  }
  ExampleTrial none(bar_set({}), method.example);
  const Battered alone = batter(none, 100, 10);
  finite = finite && alone.finite && alone.jump < 1e-9;
  return judged(finite && simplex < 1e-9, difference < 1e-9, difference,
                text("3, 6 and 20 examples in twins: twins' weights differ by ", difference, ", rows sum to 1 within ",
                     simplex, ", ", inverted, " tets inverted; without examples nothing moves"));
}

Outcome near_singular(const Method& method, const Effort&) {
  ExampleTrial trial(bar_set(usual_poses()), method.example);
  ExampleParameters parameters = trial.parameters;
  parameters.alpha = 1;
  const Vec3 dx(0.01, 0.01, 0.01);
  double amplified = 0;
  bool finite = true;
  for (const double small : {1e-2, 1e-4, 3e-6, 1e-6, 1e-9, 1e-12}) {
    Jacobian J = Jacobian::Zero(3, 3);
    J.diagonal() << 1, small, small * small;
    const WeightRow de = weight_change(parameters, J, dx);
    finite = finite && de.allFinite();
    amplified = std::max(amplified, de.norm() / dx.norm());
  }
  return judged(finite, amplified <= 20, amplified,
                text("|de| up to ", amplified, " |dx| where J's singular values are 1, s, s^2 with s down to 1e-12"));
}

Outcome weights_bounded(const Method&, const Effort&) {
  // A mesh of two parts, a handle far off it, two handles in one place.
  sim::TetMesh mesh = block({1, 0.2, 0.2}, {10, 2, 2});
  const int first = mesh.node_count();
  for (int i = 0; i < first; ++i) mesh.X.push_back(mesh.X[i] + Vec3(0, 1, 0));
  for (std::size_t t = 0, n = mesh.tets.size(); t < n; ++t) {
    Tet tet = mesh.tets[t];
    for (int& i : tet) i += first;
    mesh.tets.push_back(tet);
  }
  const std::vector<Vec3> bones{{0, 0.1, 0.1}, {1, 0.1, 0.1}, {0.5, 50, 0}, {0.5, 1.1, 0.1}, {0.5, 1.1, 0.1}};
  double low = 1, high = 0, sum = 0;
  bool finite = true;
  const auto take = [&](const Eigen::MatrixXd& W) {
    finite = finite && W.allFinite();
    low = std::min(low, W.minCoeff());
    high = std::max(high, W.maxCoeff());
    sum = std::max(sum, (W.rowwise().sum().array() - 1).abs().maxCoeff());
  };
  take(distance_weights(mesh.X, bones));
  take(authoring::handle_weights(mesh.X, bones));
  sim::TetMesh flipped = mesh;
  for (std::size_t t = 0; t < flipped.tets.size(); t += 20) std::swap(flipped.tets[t][0], flipped.tets[t][1]);
  const auto handles_at = [&](std::initializer_list<int> which) {
    authoring::Handles handles;
    for (const int b : which) handles.handles.push_back(authoring::Handle::point(bones[b]));
    return handles;
  };
  const auto biharmonic = authoring::bounded_biharmonic_weights(mesh, handles_at({0, 1, 3, 4}));
  const bool far_refused = !authoring::bounded_biharmonic_weights(mesh, handles_at({0, 1, 2}));
  const bool refused = !sim::validate(flipped, "mesh") && !authoring::bounded_biharmonic_weights(flipped, handles_at({0, 1, 3}));
  if (biharmonic) take(biharmonic->W);
  const double outside = std::max({0.0, -low, high - 1, sum});
  return judged(finite && refused && far_refused && biharmonic.has_value(), outside < 1e-9, outside,
                text("distance, Gaussian and bounded biharmonic weights lie in [", low, ", ", high, "], rows sum to 1 within ", sum,
                     "; 5 % flipped tets are ", refused ? "refused" : "taken", ", a biharmonic handle far off is ",
                     far_refused ? "refused" : "taken"));
}

Outcome feedback(const Method& method, const Effort& effort) {
  if (!method.example.aligned) return missing("the core always aligns; unaligned QLERP is compared in rows 29 to 33");
  auto made = authoring::make_barrel_asset();
  if (!made) return missing(made.error().text());
  sim::ExampleModel model{.set = std::make_shared<ExampleSet>(std::move(*made)), .mass = 20};
  model.parameters.step = method.example.step;
  model.parameters.raw_rates = method.example.raw_rates;
  model.parameters.alpha = ExampleTrial(bar_set({}), method.example).parameters.alpha;
  model.parameters.beta = 5;
  sim::SceneDescription scene{.name = "feedback", .dt = 1.0 / 250};
  scene.sleep.speed = 0;
  sim::RigidModel ground{.kind = sim::RigidKind::fixed};
  ground.shapes.push_back({Pose{}, sim::Plane{}});
  scene.bodies.push_back({.name = "ground", .model = ground});
  for (int k = 0; k < 2; ++k) {
    sim::BodyDescription barrel{.name = text("barrel ", k), .velocity = {0, k == 0 ? 0.0 : -8.0, 0}, .model = model};
    barrel.pose.p_WB = {0.1 * k, 0.46 + 1.0 * k, 0};
    if (k == 1) barrel.pose.R_WB = Eigen::AngleAxisd(0.4, Vec3(1, 0, 1).normalized());
    scene.bodies.push_back(barrel);
  }
  auto world = std::move(sim::World::create(scene).value());
  double deep_since = -1, longest = 0, start = 0, highest = 0;
  bool sound = true;
  int dents = 0;
  for (int k = 0; k < (effort.brief ? 250 : 1000); ++k) {
    const sim::StepReport report = world->step();
    dents += report.plastic_impulses;
    const sim::Energies e = world->energies();
    const double energy = e.kinetic + e.gravitational;
    if (k == 0) start = energy;
    highest = std::max(highest, energy);
    const bool deep = report.worst_penetration > 0.01;
    if (!deep)
      deep_since = -1;
    else if (deep_since < 0)
      deep_since = world->time();
    else
      longest = std::max(longest, world->time() - deep_since);
    for (const sim::Event& event : world->take_events()) sound = sound && event.kind != sim::EventKind::frozen;
  }
  for (const BodyId body : {1u, 2u})
    sound = sound && world->pose(body).p_WB.allFinite() && world->pose(body).p_WB.norm() < 100;
  const double gain = highest / start - 1;
  return judged(sound, longest < 0.5 && gain < 0.01, longest,
                text(dents, " dents; overlap above 1 cm lasts ", longest, " s at most; energy rises by ",
                     100 * std::max(0.0, gain), " %"));
}

// A wall of 10 x 10 cubes of 0.5 m, each joined to its neighbours, in free space; a ball of a tenth of its mass goes into it at
// 40 m/s. Every joint bears next to nothing.
Outcome break_storm(const Method&, const Effort& effort) {
  constexpr int kSide = 10;
  sim::SceneDescription scene{.name = "storm", .gravity = Vec3::Zero(), .dt = 1.0 / 240};
  scene.sleep.speed = 0;
  sim::RigidModel cube{.mass = 20};
  cube.shapes.push_back({Pose{}, sim::Box{Vec3::Constant(0.25)}});
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec3 centre(0.5 * (k % kSide), 0.5 * (k / kSide), 0);
    scene.bodies.push_back({.name = text("cube ", k), .pose = {Quat::Identity(), centre}, .model = cube});
    const auto join = [&](int other, const Vec3& towards) {
      scene.joints.push_back({static_cast<BodyId>(k), static_cast<BodyId>(other), centre + 0.25 * towards, 1});
    };
    if (k % kSide + 1 < kSide) join(k + 1, Vec3::UnitX());
    if (k / kSide + 1 < kSide) join(k + kSide, Vec3::UnitY());
  }
  sim::RigidModel ball{.mass = 200};
  ball.shapes.push_back({Pose{}, sim::Sphere{0.6}});
  scene.bodies.push_back({.name = "ball", .pose = {Quat::Identity(), Vec3(2.25, 2.25, 2)}, .velocity = {0, 0, -40}, .model = ball});
  auto world = std::move(sim::World::create(scene).value());
  const double start = world->energies().kinetic;
  const Vec3 momentum = world->energies().momentum;
  double highest = start, fastest = 0;
  int most = 0, broken = 0;
  bool sound = true;
  for (int k = 0; k < (effort.brief ? 60 : 240); ++k) {
    const sim::StepReport report = world->step();
    most = std::max(most, report.broken_joints);
    broken += report.broken_joints;
    highest = std::max(highest, world->energies().kinetic);
  }
  for (BodyId b = 0; b < scene.bodies.size(); ++b) {
    sound = sound && world->pose(b).p_WB.allFinite();
    fastest = std::max(fastest, world->velocity(b).norm());
  }
  const double gain = highest / start - 1, lost = (world->energies().momentum - momentum).norm() / momentum.norm();
  return judged(sound && most <= scene.max_breaks_per_step, gain < 0.01 && lost < 1e-6 && broken >= 100, gain,
                text(broken, " of ", scene.joints.size(), " joints break, ", most, " in one step at most (budget ",
                     scene.max_breaks_per_step, "); energy rises by ", 100 * std::max(0.0, gain), " %, momentum is off by ", lost,
                     ", fastest cube at the end ", fastest, " m/s"));
}

}  // namespace

std::vector<Row> example_rows() {
  return {
      {29, "alpha large, gamma small", "alpha x 100, kernel of one edge, 100 impacts of 200 N s on a bar of 100 kg",
       "E in the simplex, finite; inverted tets and self-intersections of the skin counted: 0", Family::example,
       strong_and_narrow, 1},
      {30, "QLERP: antipodal, half turns, large examples",
       "Examples at 90, 180, 270, 350, 359, 540 degrees, stored with random signs, E swept from 0 to 1",
       "continuous: jumps of a corner of a bar of 1.6 m < 1 mm within 0.001 of E; the stored sign makes no difference",
       Family::example, large_turns, 0.3},
      {31, "Orthogonal impulse, eq. 8",
       "j perpendicular to every column of J, and one that is not, at scales 1e-3, 1, 1e3",
       "de = 0; the other's de does not depend on the scale", Family::example, orthogonal, 0.1},
      {32, "Over-complete examples", "3, 6 and 20 examples, each twice, and none", "bounded; twins share their weight",
       Family::example, over_complete, 2},
      {33, "Pseudo-inverse, eq. 9", "J with singular values 1, s, s^2", "|de| <= 20 |dx| for alpha = 1",
       Family::example, near_singular, 0.1},
      {34,
       "Bad input to skinning weights",
       "A mesh in two parts, a handle 50 m off, two handles in one place, 5 % flipped tets",
       "weights in [0, 1], rows sum to 1; flipped tets are an error",
       Family::world,
       weights_bounded,
       0.1},
      {39, "Collision feedback of a dent",
       "A barrel thrown at 8 m/s on another that stands on the ground, dt = 1/250 s, 4 s",
       "overlap above 1 cm lasts < 0.5 s, no energy gain", Family::example, feedback, 4},
      {40, "Break storm of joints or prescored constraints", "180 joints of 1 N in a wall of 100 cubes, struck at 40 m/s",
       "finite, at most 32 breaks a step; energy gain < 1 %, momentum kept to 1e-6, 100 joints break", Family::world, break_storm, 1},
  };
}

}  // namespace crumple::lab::stability
