#include "server/sim/bodies/example_body.h"

#include "server/sim/example_based/deformed_mass.h"
#include "server/sim/example_based/draw_shape.h"
#include "server/sim/example_based/hull_points.h"
#include "server/sim/example_based/secondary_goal.h"
#include "server/sim/rigid/proxy.h"

#include <utility>

namespace crumple::sim {

namespace eb = example_based;

namespace {

// Collision shape and mass properties follow when a vertex has moved by this part of the body's size since they were
// taken, and when the shape comes to rest. Hulls of examples are coarser themselves (kExampleShortfall in hull_points.cpp).
constexpr double kShapeLag = 4e-3;  // 4 mm of a barrel, in scenes whose bodies lie up to 25 mm in each other

}  // namespace

std::shared_ptr<const eb::ExampleRest> SharedRests::of(const std::shared_ptr<const eb::ExampleSet>& set) {
  std::shared_ptr<const eb::ExampleRest>& rest = rests_[set];
  if (!rest) rest = std::make_shared<const eb::ExampleRest>(eb::make_rest(set));
  return rest;
}

Result<ExampleBody> ExampleBody::make(BodyId id, const BodyDescription& body, const ExampleModel& model,
                                      RigidWorld& rigid, const std::string& field, SharedRests& shared) {
  ExampleBody example;
  example.id = id;
  example.friction = model.friction;
  example.parameters_ = model.parameters;
  example.rest_ = shared.of(model.set);
  example.state = eb::make_state(example.rest(), model.parameters);
  example.mass_ = model.mass > 0 ? model.mass : model.density * example.rest().volume;
  auto added = rigid.add_deformable(id, example.shape(), example.mass_properties(), model.friction,
                                    model.parameters.restitution, body.pose, body.velocity, body.angular_velocity);
  if (!added) return std::unexpected(Error{added.error().code, field + "." + added.error().field, added.error().message});
  example.shape_lag_ = kShapeLag * example.rest().size;
  example.shape_x_ = example.state.x;
  example.make_proxy();
  example.follow(body.pose);
  return example;
}

DeformableShape ExampleBody::shape() const {
  if (parameters_.triangle_collision) return SurfaceMesh{state.x, rest().surface};
  if (parameters_.tet_collision) {
    std::vector<ConvexHull> tets;
    for (const Tet& tet : rest().set->mesh.tets)
      tets.push_back({{state.x[tet[0]], state.x[tet[1]], state.x[tet[2]], state.x[tet[3]]}});
    return tets;
  }
  std::vector<ConvexHull> parts(rest().hull_vertices.size());
  for (std::size_t p = 0; p < parts.size(); ++p) eb::hull_points(rest(), state, static_cast<int>(p), parts[p].points);
  return parts;
}

MassProperties ExampleBody::mass_properties() const {
  const eb::DeformedMass deformed = eb::deformed_mass(rest(), state.x, mass_);
  return {deformed.mass, deformed.com, deformed.inertia};
}

void ExampleBody::make_proxy() {
  std::vector<PlacedShape> hulls;
  for (std::size_t p = 0; p < rest().hull_vertices.size(); ++p) {
    ConvexHull hull;
    eb::hull_points(rest(), state, static_cast<int>(p), hull.points);
    hulls.push_back({Pose{}, std::move(hull)});
  }
  // A part that was crushed flat has no hull; the proxy then stays as it was.
  if (auto tets = proxy_tets(hulls)) {
    proxy = std::move(*tets);
    collision = contact::make_collision_mesh(proxy.tets, proxy.X, {});
    x.resize(proxy.X.size());
  }
}

void ExampleBody::follow(const Pose& X_WB) {
  for (std::size_t n = 0; n < x.size(); ++n) x[n] = X_WB * proxy.X[n];
}

bool ExampleBody::shape_is_due() const {
  if (eb::is_at_rest(state)) return !shape_follows_;
  for (int i : work_.changed) {
    if ((state.x[i] - shape_x_[i]).squaredNorm() > shape_lag_ * shape_lag_) return true;
  }
  return false;
}

void ExampleBody::hold() {
  held_ = true;
  state.dE.setZero();
  state.active.clear();
  state.fatigue.clear();
  eb::leave_goal(state);
  state.x = shape_x_;
}

void ExampleBody::deform(double dt, double rate_dt, const ThreadPool& pool) {
  // Impulses that do not exceed beta together cannot at any vertex: nothing to look up for a body at rest (eq. 4).
  const double start = work_.now();
  double strength = 0;
  for (const eb::PointImpulse& strike : strikes_) strength += strike.impulse.norm();
  impulses_.clear();
  const bool may_dent = !(strength <= parameters_.beta * rest().least_beta_scale) || (parameters_.fatigue_time > 0 && strength > 0);
  if (may_dent && !held_) {
    eb::locate_impulses(rest(), state, strikes_, eb::Site::nearest_vertex, boxes_, impulses_);
  }
  strikes_.clear();
  work_.times.locate = work_.now() - start;
  work_.times.shape = 0;
  const eb::DeformReport& report = eb::deform(rest(), parameters_, {dt, rate_dt}, mass_, impulses_, pool, state, work_);
  if (!report.finite) return hold();
  shape_follows_ = shape_follows_ && !report.moved;
  if (!shape_is_due()) return;
  const double deformed = work_.now();
  // A shape that cannot be had (a part crushed flat) keeps the last collision shape; drawing goes on.
  if (auto prepared = PreparedShape::make(shape(), mass_properties())) {
    next_shape_ = *std::move(prepared);
    if (!meets_only_rigid || eb::is_at_rest(state)) make_proxy();
  }
  shape_x_ = state.x;
  shape_follows_ = true;
  work_.times.shape = work_.now() - deformed;
}

void ExampleBody::set_parameters(const SetExampleParameters& changed) {
  eb::ExampleParameters& p = parameters_;
  for (const auto& [value, own] : {std::pair(&changed.alpha, &p.alpha), std::pair(&changed.beta, &p.beta), std::pair(&changed.gamma, &p.gamma),
                                   std::pair(&changed.lambda, &p.lambda), std::pair(&changed.mu, &p.mu), std::pair(&changed.nu, &p.nu),
                                   std::pair(&changed.restitution, &p.restitution), std::pair(&changed.goal_tolerance, &p.goal_tolerance),
                                   std::pair(&changed.fatigue_time, &p.fatigue_time)}) {
    *own = value->value_or(*own);
  }
  p.secondary_goal = changed.secondary_goal.value_or(p.secondary_goal);
  p.keep_volume = changed.keep_volume.value_or(p.keep_volume);
}

DentOutcome ExampleBody::settle(RigidWorld& rigid) {
  const eb::DeformReport& report = work_.report;
  rigid.set_restitution(id, report.restitution);
  if (!report.finite) return {.finite = false};
  if (next_shape_) rigid.set_shape_and_mass(id, *std::exchange(next_shape_, std::nullopt));

  DentOutcome outcome{.plastic = static_cast<int>(report.plastic.size())};
  for (const eb::PlasticImpulse& plastic : report.plastic) {
    if (plastic.magnitude <= outcome.strongest) continue;
    outcome.strongest = plastic.magnitude;
    outcome.point = rigid.pose(id) * state.x[plastic.vertex];
  }
  return outcome;
}

bool ExampleBody::is_settled() const {
  return eb::is_at_rest(state) && shape_follows_ && !work_.report.creeps && (parameters_.mu <= 0 || state.restitution >= parameters_.restitution);
}

BodyTopology ExampleBody::topology(const BodyDescription& body) const {
  BodyTopology drawn{.id = id, .name = body.name, .model = BodyModel::example_based, .deformable = true};
  drawn.colour = body.colour;
  drawn.opacity = body.opacity;
  drawn.triangles = rest().draw_triangles;
  for (int e = 1; e < rest().set->example_count(); ++e) drawn.channels.push_back(rest().set->examples[e].name);
  BodyFrame frame;
  capture(body.pose, false, frame);
  drawn.vertices = std::move(frame.positions);
  return drawn;
}

void ExampleBody::capture(const Pose& X_WB, bool with_values, BodyFrame& frame) const {
  std::vector<Vec3> drawn(eb::draw_vertex_count(rest()));
  eb::draw_positions(rest(), state, drawn);
  frame.id = id;
  frame.pose = X_WB;
  frame.positions.clear();
  for (const Vec3& p : drawn) frame.positions.push_back((X_WB * p).cast<float>());
  frame.values.assign(with_values ? drawn.size() * static_cast<std::size_t>(rest().set->example_count() - 1) : 0, 0);
  if (with_values) eb::draw_weights(rest(), state, frame.values);
}

void ExampleBody::hash(StateHash& hash) const {
  for (double e : state.E.reshaped()) hash.add(e);
  for (double e : state.dE.reshaped()) hash.add(e);
  hash.add(std::span<const Vec3>(state.x));
  hash.add(std::span<const Vec3>(shape_x_));
  hash.add(state.restitution);
  for (const eb::SiteMemory& site : state.fatigue) {
    hash.add(static_cast<std::uint64_t>(site.vertex));
    hash.add(site.impulse);
  }
  for (int i : state.goal_rows) hash.add(static_cast<std::uint64_t>(i));
  hash.add(std::span<const Vec3>(state.goal_x));
  hash.add(static_cast<std::uint64_t>(state.goal_left));
  for (double p : {parameters_.alpha, parameters_.beta, parameters_.gamma, parameters_.lambda, parameters_.mu, parameters_.nu, parameters_.restitution,
                   parameters_.goal_tolerance, parameters_.fatigue_time})
    hash.add(p);
  hash.add(static_cast<std::uint64_t>(parameters_.secondary_goal));
  hash.add(static_cast<std::uint64_t>(parameters_.keep_volume));
  hash.add(static_cast<std::uint64_t>(held_));
}

}  // namespace crumple::sim
