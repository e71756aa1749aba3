#include "server/lab/stability/example_trial.h"

#include "server/lab/stability/self_intersections.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/example_based/deformed_mass.h"
#include "server/sim/example_based/weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace crumple::lab::stability {

using namespace sim::example_based;

namespace {

BoneTransform turn(double degrees, const Vec3& axis, const Vec3& t = Vec3::Zero()) {
  return {Quat(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized())), t};
}
BoneTransform shift(double x, double y, double z) { return {Quat::Identity(), Vec3(x, y, z)}; }

}  // namespace

std::shared_ptr<ExampleSet> bar_set(const std::vector<Pose3>& poses) {
  auto set = std::make_shared<ExampleSet>();
  set->mesh = block({0.6, 0.6, 1.6}, {3, 3, 8});
  for (Vec3& X : set->mesh.X) X -= Vec3(0.3, 0.3, 0.8);
  const std::vector<Vec3> bones{{0, 0, -0.8}, Vec3::Zero(), {0, 0, 0.8}};
  set->W = distance_weights(set->mesh.X, bones);
  set->examples.push_back({"rest", std::vector<BoneTransform>(3)});
  for (const Pose3& pose : poses) set->examples.push_back({"pose", {pose.begin(), pose.end()}});
  set->convex_parts.emplace_back();
  for (int i = 0; i < set->vertex_count(); ++i) set->convex_parts[0].push_back(i);
  return set;
}

std::vector<Pose3> usual_poses() {
  return {{shift(0, 0, 0.2), {}, shift(0, 0, -0.3)},
          {turn(25, Vec3::UnitX()), {}, turn(-40, Vec3(1, 0.2, 0), Vec3(0, 0.1, 0))},
          {BoneTransform{}, turn(15, Vec3::UnitY(), Vec3(-0.25, 0, 0.05)), turn(10, Vec3::UnitZ())}};
}

Pose3 end_turned(double degrees) { return {BoneTransform{}, BoneTransform{}, turn(degrees, Vec3::UnitX())}; }

ExampleTrial::ExampleTrial(std::shared_ptr<const ExampleSet> set, const ExampleMethod& method_)
    : method(method_), rest(make_rest(std::move(set))) {
  if (!method.aligned)
    for (std::size_t k = 0; k < rest.poses.size(); ++k) rest.poses[k].q *= rest.sign[k];
  parameters.step = method.step;
  parameters.raw_rates = method.raw_rates;
  // Eq. 9's alpha is a number, eq. 8's 1/m, eq. 10's 1/m^2: with |J| near 0.3 m they dent alike.
  using Step = ExampleParameters::Step;
  parameters.alpha = method.step == Step::equation9 ? 5 : method.step == Step::equation10 ? 60 : 20;
  parameters.beta = 1;
  parameters.gamma = 0.5;
  state = make_state(rest, parameters);
}

void ExampleTrial::step(std::span<const VertexImpulse> impulses) {
  const std::vector<Vec3> before = state.x;
  deform(rest, parameters, times, mass, impulses, pool, state, work);
  last_move = 0;
  for (std::size_t i = 0; i < before.size(); ++i) last_move = std::max(last_move, (state.x[i] - before[i]).norm());
}

int ExampleTrial::random_vertex(double uniform) const {
  return rest.surface_vertices[static_cast<std::size_t>(uniform * static_cast<double>(rest.surface_vertices.size()))];
}

double ExampleTrial::simplex_error() const {
  if (!((state.E.array() >= 0).all() && (state.E.array() <= 1).all())) return std::numeric_limits<double>::infinity();
  return (state.E.rowwise().sum().array() - 1).abs().maxCoeff();
}

bool ExampleTrial::finite() const {
  return state.E.allFinite() && state.dE.allFinite() &&
         std::ranges::all_of(state.x, [](const Vec3& x) { return x.allFinite(); });
}

int ExampleTrial::inverted() const { return inverted_tets(rest, state.x); }

int ExampleTrial::intersections() const {
  std::vector<Triangle> triangles;
  for (const sim::SurfaceFace& face : sim::surface_faces(rest.set->mesh.tets)) triangles.push_back(face.nodes);
  return self_intersections(triangles, state.x);
}

double ExampleTrial::shortest_edge() const { return *std::ranges::min_element(rest.graph.length); }

Battered batter(ExampleTrial& trial, double impulse, int impacts) {
  Random random(5);
  Battered result;
  const auto look = [&] {
    result.finite = result.finite && trial.finite();
    if (!result.finite) return;
    result.simplex_error = std::max(result.simplex_error, trial.simplex_error());
    result.jump = std::max(result.jump, trial.last_move);
  };
  for (int k = 0; k < impacts && result.finite; ++k) {
    const VertexImpulse hit{.vertex = trial.random_vertex(random.uniform(0, 1)),
                            .impulse = impulse * random.vec3(-1, 1).normalized()};
    trial.step(std::span(&hit, 1));
    look();
    for (int wait = 0; wait < 4 && result.finite; ++wait) {
      trial.step({});
      look();
    }
  }
  for (int k = 0; k < 250 && result.finite; ++k) {
    trial.step({});
    look();
  }
  result.last_move = trial.last_move;
  if (!result.finite) return result;
  result.inverted = trial.inverted();
  result.intersections = trial.intersections();
  return result;
}

}  // namespace crumple::lab::stability
