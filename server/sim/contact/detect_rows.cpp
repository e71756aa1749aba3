#include "server/sim/contact/detector.h"
#include "server/sim/contact/weight_friction.h"

#include <algorithm>
#include <cmath>

// What makes a row of an overlap: sides, law and friction.
namespace crumple::sim::contact {
namespace {

// Rows of rigid fragments are weaker and take depth back more slowly than others, by these factors: a heap of shards locks into
// itself, and settles sooner so; chaotic scenes were on average solved in a fifth less.
constexpr double kFragmentKappa = 0.3, kFragmentRecovery = 2;

}  // namespace

void Detector::set_friction(ContactRow& row, double a, double b) const {
  const double mu = std::sqrt(a * b);
  if (in.settings.friction == FrictionLaw::coulomb) row.friction = mu;
  else row.weight_speed = weight_speed(mu, row.normal, in.gravity, in.dt);
}

// The arm is from where the centre of mass is when the row's point is where it is: part s of the way on.
void Detector::set_rigid(ContactRow& row, int side, double s, const RigidMotion& rigid) const {
  Vec3 moved = Vec3::Zero();
  if (!in.settings.raw_damping) moved = s * in.dt * (rigid.movable ? Vec3(rigid.v + in.dt * in.gravity) : rigid.v);
  row.sides[side].rigid = rigid.movable;
  row.sides[side].arm = row.point - rigid.p_WC - moved;
}

// Returns the side's part of the velocity u with which the bodies came here.
Vec3 Detector::add_side(ContactRow& row, int side, double at, const Unit& unit, const CollisionTet& t,
                        const Eigen::Vector4d& b) const {
  const CollisionBody& body = in.bodies[unit.body];
  const double sign = side == 0 ? 1 : -1;
  ContactSide& s = row.sides[side];
  s.body = unit.body;
  s.tet = t.id;
  Vec3 came = Vec3::Zero();
  for (int k = 0; k < 4; ++k) came += sign * b[k] * placed[unit.body].v[t.nodes[k]];
  if (body.rigid) {
    set_rigid(row, side, at, *body.rigid);
    if (!s.rigid) row.known_velocity += sign * (body.rigid->v + body.rigid->w.cross(s.arm));
    return came;
  }
  for (int k = 0; k < 4; ++k) {
    const int node = t.nodes[k];
    if (!body.fixed.empty() && body.fixed[node]) {
      row.known_velocity += sign * b[k] * body.v[node];
    } else {
      s.nodes[s.node_count] = node;
      s.weights[s.node_count++] = sign * b[k];
    }
  }
  return came;
}

void Detector::finish(ContactRow& row, const Vec3& u, double s, double depth, double mass, double volume) const {
  const ContactSettings& settings = in.settings;
  if (settings.raw_damping) {
    row.depth = depth;
    row.c_n = in.dt * settings.phi * row.area;
    row.target = 0;
    return;
  }
  row.depth = depth + s * in.dt * row.normal.dot(u);
  const bool debris = std::ranges::any_of(row.sides, [&](const ContactSide& side) { return is_fragment(side.body); });
  row.c_n = (debris ? kFragmentKappa : 1) * settings.kappa * mass * row.area / std::cbrt(volume * volume);
  const double tau = (debris ? kFragmentRecovery : 1) * settings.recovery_steps * in.dt;
  row.target = row.depth < 0 ? row.depth / in.dt : std::min(row.depth / tau, settings.max_recovery_speed);
}

Mat34 Detector::at_start(const Unit& unit, const CollisionTet& t) const {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = in.bodies[unit.body].x[t.nodes[k]];
  return x;
}

// A fast body may be more than half through a thin one where it is detected; the overlap's normal then points on, and
// would push it out at the far side. Where the two tets were apart at the start of the step along their relative motion
// u, they must meet against it: the normal is turned round, the depth is minus the gap that was between them.
void Detector::turn_back(ContactRow& row, const Vec3& u, const Mat34& a, const Mat34& b) const {
  if (row.normal.dot(u) <= 0) return;
  if ((u.transpose() * a).maxCoeff() > (u.transpose() * b).minCoeff()) return;
  row.normal = -row.normal;
  const double gap = (row.normal.transpose() * a).minCoeff() - (row.normal.transpose() * b).maxCoeff();
  row.depth = -std::max(gap, 0.0);
  row.target = row.depth / in.dt;
}

}  // namespace crumple::sim::contact
