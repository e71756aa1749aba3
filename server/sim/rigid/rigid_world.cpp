#include "server/sim/rigid/rigid_world.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "server/sim/rigid/rigid_world_body.h"
#include "server/sim/rigid/rigid_world_joint.h"

namespace crumple::sim {

using bullet::Body;

struct RigidWorld::Impl {
  explicit Impl(const RigidSettings& settings)
      : gravity(settings.gravity), world(bullet::to_bullet(settings.gravity), settings.iterations, settings.tolerance) {}

  Body& at(BodyId id) const {
    assert(id < bodies.size() && bodies[id]);
    return *bodies[id];
  }
  void insert(std::unique_ptr<Body> body);
  void start(Body& body, const Vec3& velocity, const Vec3& angular_velocity);
  void substep(double h, double fraction, RigidStepReport& report);
  void aim_kinematic(double h, double fraction);
  void freeze_unsound(double h, RigidStepReport& report);
  bool wake_touched(double h, RigidStepReport& report);
  void add_joined(std::vector<BodyId>& touched);
  Vec3 weight_of(const Body& body) const { return body.weightless ? Vec3(Vec3::Zero()) : gravity; }
  void combine_materials(RigidStepReport& report);
  void gather_impulses();

  Vec3 gravity;
  bullet::DynamicsWorld world;
  std::vector<std::unique_ptr<Body>> bodies;  // by id; null where there is none
  std::vector<std::unique_ptr<bullet::Joint>> joints;  // by id; null where it is parted. Goes before the bodies
  std::vector<Pose> kinematic_next;           // by id
  std::vector<ContactImpulse> impulses;
};

RigidWorld::RigidWorld(const RigidSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
RigidWorld::~RigidWorld() = default;

// ---- bodies ----------------------------------------------------------------------------------------------------

void RigidWorld::Impl::insert(std::unique_ptr<Body> body) {
  const BodyId id = body->contact.id;
  if (id >= bodies.size()) bodies.resize(id + 1);
  assert(!bodies[id]);
  bodies[id] = std::move(body);
}

// velocity: of the body's origin.
void RigidWorld::Impl::start(Body& body, const Vec3& velocity, const Vec3& angular_velocity) {
  body.v = velocity + angular_velocity.cross(body.x - body.pose().p_WB);
  body.L = world_inertia(body.R_WP, body.I) * angular_velocity;
}

Result<void> RigidWorld::add_body(BodyId id, const RigidModel& model, const Pose& X_WB, const Vec3& velocity,
                                  const Vec3& angular_velocity) {
  for (std::size_t i = 0; i < model.shapes.size(); ++i) {
    const Shape& shape = model.shapes[i].shape;
    const std::string field = "shapes[" + std::to_string(i) + "]";
    if (std::holds_alternative<Plane>(shape) && model.kind != RigidKind::fixed) {
      return invalid(field, "is a plane, which only a fixed body may have");
    }
    const auto* triangles = std::get_if<TriangleShape>(&shape);
    if (triangles && sound_triangles(triangles->mesh).empty()) return invalid(field, "has no triangle with an area");
  }

  std::unique_ptr<Body> body;
  if (model.kind == RigidKind::dynamic) {
    Result<MassProperties> properties = shapes_mass(model.shapes, model.density, "shapes");
    if (!properties) return std::unexpected(properties.error());
    if (model.mass > 0) properties = with_mass(*properties, model.mass);
    body = std::make_unique<Body>(impl_->world, id, *properties, X_WB);
    body->set_moving_shape(bullet::moving_shape(model.shapes, bullet::inverse(body->X_BP())));
    impl_->start(*body, velocity, angular_velocity);
  } else {
    body = std::make_unique<Body>(impl_->world, id, model.kind, model.shapes, X_WB);
  }
  body->contact.friction = model.friction;
  body->contact.restitution = model.restitution;
  impl_->insert(std::move(body));
  return {};
}

static Result<void> validate(const DeformableShape& shape, const MassProperties& properties) {
  const auto finite = [](const std::vector<Vec3>& points) {
    return std::ranges::all_of(points, [](const Vec3& p) { return p.allFinite(); });
  };
  if (const auto* parts = std::get_if<std::vector<ConvexHull>>(&shape)) {
    if (parts->empty()) return invalid("shape", "has no part");
    for (const ConvexHull& part : *parts) {
      if (part.points.empty() || !finite(part.points))
        return invalid("shape", "has a part without points or with non-finite ones");
    }
  } else {
    const auto& mesh = std::get<SurfaceMesh>(shape);
    if (!finite(mesh.vertices)) return invalid("shape", "has a non-finite vertex");
    if (sound_triangles(mesh).empty()) return invalid("shape", "has no triangle with an area");
  }
  if (!(properties.mass > 0) || !std::isfinite(properties.mass) || !properties.com.allFinite() ||
      !properties.inertia.allFinite() || !(principal_axes(properties.inertia).moments.minCoeff() > 0)) {
    return invalid("mass properties", "must be finite and positive");
  }
  return {};
}

PreparedShape::PreparedShape(std::unique_ptr<bullet::CollisionShape> shape, const MassProperties& properties)
    : shape_(std::move(shape)), properties_(properties) {}
PreparedShape::PreparedShape(PreparedShape&&) noexcept = default;
PreparedShape& PreparedShape::operator=(PreparedShape&&) noexcept = default;
PreparedShape::~PreparedShape() = default;

Result<PreparedShape> PreparedShape::make(const DeformableShape& shape, const MassProperties& properties) {
  if (const Result<void> valid = validate(shape, properties); !valid) return std::unexpected(valid.error());
  const Pose X_PB = bullet::inverse(bullet::principal_frame(properties).X_BP);
  return PreparedShape(bullet::deformable_shape(shape, X_PB), properties);
}

Result<void> RigidWorld::add_deformable(BodyId id, const DeformableShape& shape, const MassProperties& properties,
                                        double friction, double restitution, const Pose& X_WB, const Vec3& velocity,
                                        const Vec3& angular_velocity) {
  Result<PreparedShape> prepared = PreparedShape::make(shape, properties);
  if (!prepared) return std::unexpected(prepared.error());
  auto body = std::make_unique<Body>(impl_->world, id, properties, X_WB);
  body->set_moving_shape(std::move(prepared->shape_));
  impl_->start(*body, velocity, angular_velocity);
  body->contact.friction = friction;
  body->contact.restitution = restitution;
  impl_->insert(std::move(body));
  return {};
}

void RigidWorld::remove(BodyId id) {
  assert(contains(id));
  for (auto& joint : impl_->joints)
    if (joint && (joint->a().contact.id == id || joint->b().contact.id == id)) joint.reset();
  impl_->bodies[id].reset();
}

void RigidWorld::set_shape_and_mass(BodyId id, PreparedShape next) {
  Body& body = impl_->at(id);
  if (!body.is_moving()) return;
  assert(!body.is_asleep());
  body.set_mass_properties(next.properties_);
  body.set_moving_shape(std::move(next.shape_));
}

Result<void> RigidWorld::set_shape_and_mass(BodyId id, const DeformableShape& shape, const MassProperties& properties) {
  Result<PreparedShape> next = PreparedShape::make(shape, properties);
  if (!next) return std::unexpected(next.error());
  set_shape_and_mass(id, *std::move(next));
  return {};
}

void RigidWorld::set_target(BodyId id, const Pose& X_WB) {
  assert(impl_->at(id).kind() == RigidKind::kinematic);
  impl_->at(id).target = X_WB;
}

void RigidWorld::set_friction(BodyId id, double friction) { impl_->at(id).contact.friction = friction; }
void RigidWorld::set_restitution(BodyId id, double restitution) { impl_->at(id).contact.restitution = restitution; }

void RigidWorld::sleep(BodyId id, bool carried) {
  Body& body = impl_->at(id);
  if (!body.is_stepped()) return;
  body.carried = carried;
  body.sleep();
}

void RigidWorld::wake(BodyId id) {
  if (is_asleep(id)) impl_->at(id).wake();
}

bool RigidWorld::is_asleep(BodyId id) const { return impl_->at(id).is_asleep(); }

void RigidWorld::set_pose(BodyId id, const Pose& X_WB) {
  Body& body = impl_->at(id);
  if (!body.is_moving()) return;
  assert(!body.is_asleep());
  const Vec3 w = angular_velocity(id);
  body.set_pose(X_WB);
  body.L = world_inertia(body.R_WP, body.I) * w;
}

void RigidWorld::set_velocity(BodyId id, const Vec3& com_velocity, const Vec3& angular_velocity) {
  Body& body = impl_->at(id);
  if (!body.is_moving()) return;
  assert(!body.is_asleep());
  body.v = com_velocity;
  body.L = world_inertia(body.R_WP, body.I) * angular_velocity;
}

void RigidWorld::apply_impulse(BodyId id, const Vec3& impulse_W, const Vec3& point_W) {
  apply_momentum(id, impulse_W, (point_W - impl_->at(id).x).cross(impulse_W));
}

void RigidWorld::apply_momentum(BodyId id, const Vec3& linear, const Vec3& angular) {
  Body& body = impl_->at(id);
  if (!body.is_moving()) return;
  assert(!body.is_asleep());
  body.v += linear / body.mass;
  body.L += angular;
}

// ---- joints ----------------------------------------------------------------------------------------------------

int RigidWorld::join(BodyId a, BodyId b, const Vec3& point_W) {
  assert(a != b && (is_moving(a) || is_moving(b)));
  const int id = static_cast<int>(impl_->joints.size());
  impl_->joints.push_back(std::make_unique<bullet::Joint>(impl_->world, id, impl_->at(a), impl_->at(b),
                                                          Pose{Quat::Identity(), point_W}));
  return id;
}

void RigidWorld::part(int joint) { impl_->joints[joint].reset(); }
bool RigidWorld::is_joined(int joint) const { return impl_->joints[joint] != nullptr; }
JointLoad RigidWorld::joint_load(int joint) const { return {impl_->joints[joint]->impulse, impl_->joints[joint]->couple}; }
Vec3 RigidWorld::joint_point(int joint) const { return impl_->joints[joint]->point_W(); }

// ---- step ------------------------------------------------------------------------------------------------------

RigidStepReport RigidWorld::step(double dt, int substeps) {
  assert(dt > 0 && substeps >= 1);
  RigidStepReport report;
  impl_->impulses.clear();
  for (const auto& body : impl_->bodies) {
    if (body) body->weightless = false;
  }
  for (const auto& joint : impl_->joints) {
    if (joint) joint->begin_step();
  }
  for (int m = 0; m < impl_->world.manifold_count(); ++m) {
    const btPersistentManifold& manifold = impl_->world.manifold(m);
    for (int i = 0; i < manifold.getNumContacts(); ++i) manifold.getContactPoint(i).m_userPersistentData = nullptr;
  }
  for (int s = 0; s < substeps; ++s) impl_->substep(dt / substeps, 1.0 / (substeps - s), report);
  return report;
}

void RigidWorld::Impl::substep(double h, double fraction, RigidStepReport& report) {
  freeze_unsound(h, report);
  aim_kinematic(h, fraction);
  report.contacts = 0;
  if (std::ranges::any_of(bodies, [](const auto& body) { return body && body->is_stepped(); })) {
    for (const auto& body : bodies) {
      if (body && body->is_stepped()) body->begin_substep(weight_of(*body));
    }
    world.detect(h);
    while (wake_touched(h, report)) world.detect(h);
    combine_materials(report);
    for (const auto& joint : joints) {
      if (joint) joint->begin_substep();
    }
    world.solve(h);
    report.sweeps += world.contact_solver().sweeps();
    report.residual = std::max(report.residual, world.contact_solver().residual());
    for (const auto& joint : joints) {
      if (joint) joint->end_substep(h);
    }
    gather_impulses();
  }
  for (const auto& body : bodies) {
    if (!body) continue;
    if (body->kind() == RigidKind::kinematic) body->move_to(kinematic_next[body->contact.id]);
    if (body->is_stepped() && !body->end_substep(weight_of(*body), h)) {
      body->freeze();
      report.frozen.push_back(body->contact.id);
    }
  }
}

// Bodies that sleep and of which a contact would be felt in this substep. True if there were any: what they touch in turn
// is not known yet.
bool RigidWorld::Impl::wake_touched(double h, RigidStepReport& report) {
  std::vector<BodyId> touched;
  const auto velocity = [&](const Body& body, const btVector3& point) -> Vec3 {
    if (!body.is_stepped()) return Vec3::Zero();
    const Vec3 w = sim::angular_velocity(body.R_WP, body.I, body.L);
    return body.v + h * weight_of(body) + w.cross(bullet::from_bullet(point) - body.x);
  };
  for (int m = 0; m < world.manifold_count(); ++m) {
    const btPersistentManifold& manifold = world.manifold(m);
    const Body& a = *bodies[bullet::contact_body(manifold.getBody0())->id];
    const Body& b = *bodies[bullet::contact_body(manifold.getBody1())->id];
    if (a.is_asleep() == b.is_asleep()) continue;
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      const Vec3 apart = velocity(a, point.getPositionWorldOnA()) - velocity(b, point.getPositionWorldOnB());
      if (point.getDistance() + h * apart.dot(bullet::from_bullet(point.m_normalWorldOnB)) > 0) continue;
      touched.push_back(a.is_asleep() ? a.contact.id : b.contact.id);
      break;
    }
  }
  add_joined(touched);
  std::ranges::sort(touched);
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (BodyId id : touched) {
    Body& body = *bodies[id];
    body.wake();
    body.weightless = body.carried;
    body.begin_substep(weight_of(body));
    report.woken.push_back(id);
  }
  return !touched.empty();
}

// Sleepers that hang on sleepers: in this substep they would be as good as fixed.
void RigidWorld::Impl::add_joined(std::vector<BodyId>& touched) {
  for (std::size_t k = 0; k < touched.size(); ++k) {
    for (const auto& joint : joints) {
      if (!joint) continue;
      const BodyId a = joint->a().contact.id, b = joint->b().contact.id;
      if (a != touched[k] && b != touched[k]) continue;
      const BodyId other = a == touched[k] ? b : a;
      if (bodies[other]->is_asleep() && std::ranges::find(touched, other) == touched.end()) touched.push_back(other);
    }
  }
}

void RigidWorld::Impl::freeze_unsound(double h, RigidStepReport& report) {
  for (const auto& body : bodies) {
    if (!body || !body->is_stepped() || body->is_sound(h)) continue;
    body->freeze();
    report.frozen.push_back(body->contact.id);
  }
}

// Each substep goes the same part of what remains: linear in position, slerp in rotation.
void RigidWorld::Impl::aim_kinematic(double h, double fraction) {
  kinematic_next.resize(bodies.size());
  for (const auto& body : bodies) {
    if (!body || body->kind() != RigidKind::kinematic) continue;
    Pose& next = kinematic_next[body->contact.id];
    next.p_WB = body->x + fraction * (body->target.p_WB - body->x);
    next.R_WB = body->R_WP.slerp(fraction, body->target.R_WB).normalized();
    body->aim_at(next, h);
  }
}

// Every substep, not only when Bullet makes a contact point: restitution changes while bodies touch (Jones et al. 2016,
// eq. 15).
void RigidWorld::Impl::combine_materials(RigidStepReport& report) {
  report.contacts = 0;
  for (int m = 0; m < world.manifold_count(); ++m) {
    btPersistentManifold& manifold = world.manifold(m);
    const bullet::ContactBody& a = *bullet::contact_body(manifold.getBody0());
    const bullet::ContactBody& b = *bullet::contact_body(manifold.getBody1());
    report.contacts += manifold.getNumContacts();
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      btManifoldPoint& point = manifold.getContactPoint(i);
      point.m_combinedFriction = std::sqrt(a.friction * b.friction);
      point.m_combinedRestitution = a.restitution * b.restitution;
      report.worst_penetration = std::max(report.worst_penetration, -point.getDistance());
    }
  }
}

void RigidWorld::Impl::gather_impulses() {
  for (int m = 0; m < world.manifold_count(); ++m) {
    const btPersistentManifold& manifold = world.manifold(m);
    const BodyId a = bullet::contact_body(manifold.getBody0())->id, b = bullet::contact_body(manifold.getBody1())->id;
    if (!bodies[a]->is_moving() && !bodies[b]->is_moving()) continue;
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      const Vec3 impulse = bullet::from_bullet(point.m_appliedImpulse * point.m_normalWorldOnB +
                                               point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1 +
                                               point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2);
      if (impulse.isZero(0) || !impulse.allFinite()) continue;
      // The point itself remembers its entry in the list, plus one, while Bullet keeps it.
      auto entry = reinterpret_cast<std::uintptr_t>(point.m_userPersistentData);
      if (entry == 0) {
        ContactImpulse& first = impulses.emplace_back();
        entry = impulses.size();
        point.m_userPersistentData = reinterpret_cast<void*>(entry);
        first.a = a;
        first.b = b;
        first.point_a_W = bullet::from_bullet(point.getPositionWorldOnA());
        first.point_b_W = bullet::from_bullet(point.getPositionWorldOnB());
        first.point_a_B = bullet::inverse(bodies[a]->pose()) * first.point_a_W;
        first.point_b_B = bullet::inverse(bodies[b]->pose()) * first.point_b_W;
        first.normal_W = bullet::from_bullet(point.m_normalWorldOnB);
        first.impulse_W.setZero();
      }
      impulses[entry - 1].impulse_W += impulse;
      impulses[entry - 1].normal_impulse += point.m_appliedImpulse;
    }
  }
}

// ---- what the world is like ------------------------------------------------------------------------------------

const std::vector<ContactImpulse>& RigidWorld::contact_impulses() const { return impl_->impulses; }
bool RigidWorld::contains(BodyId id) const { return id < impl_->bodies.size() && impl_->bodies[id]; }
bool RigidWorld::is_moving(BodyId id) const { return impl_->at(id).is_moving(); }
Pose RigidWorld::pose(BodyId id) const { return impl_->at(id).pose(); }
Vec3 RigidWorld::com(BodyId id) const { return impl_->at(id).x; }
Vec3 RigidWorld::velocity(BodyId id) const { return impl_->at(id).v; }

Vec3 RigidWorld::angular_velocity(BodyId id) const {
  const Body& body = impl_->at(id);
  return body.is_moving() ? sim::angular_velocity(body.R_WP, body.I, body.L) : body.kinematic_w;
}

double RigidWorld::mass(BodyId id) const { return is_moving(id) ? impl_->at(id).mass : 0; }

Mat3 RigidWorld::inertia(BodyId id) const {
  const Body& body = impl_->at(id);
  return body.is_moving() ? world_inertia(body.R_WP, body.I) : Mat3::Zero();
}

Vec3 RigidWorld::momentum(BodyId id) const { return mass(id) * velocity(id); }
Vec3 RigidWorld::angular_momentum(BodyId id) const { return impl_->at(id).L; }

double RigidWorld::kinetic_energy(BodyId id) const {
  return 0.5 * momentum(id).dot(velocity(id)) + 0.5 * angular_momentum(id).dot(angular_velocity(id));
}

void RigidWorld::append_state(std::vector<double>& state) const {
  const auto append = [&](const auto& vector) {
    state.insert(state.end(), vector.data(), vector.data() + vector.size());
  };
  for (const auto& body : impl_->bodies) {
    if (!body) continue;
    append(body->x);
    append(body->R_WP.coeffs());
    append(body->v);
    append(body->L);
    append(body->I);
    state.push_back(body->contact.restitution);
    state.push_back(body->is_asleep() ? 1 : 0);
  }
  for (const auto& joint : impl_->joints) state.push_back(joint ? 1 : 0);
  for (int m = 0; m < impl_->world.manifold_count(); ++m) {
    const btPersistentManifold& manifold = impl_->world.manifold(m);
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      append(bullet::from_bullet(point.m_localPointA));
      append(bullet::from_bullet(point.m_localPointB));
      state.insert(state.end(),
                   {point.m_appliedImpulse, point.m_appliedImpulseLateral1, point.m_appliedImpulseLateral2});
    }
  }
}

}  // namespace crumple::sim
