#include "server/sim/bodies/rigid_fragment.h"

#include "server/sim/command.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace crumple::sim {

RigidFragment::RigidFragment(Piece piece)
    : piece_(std::move(piece)), collision_(contact::make_collision_mesh(piece_.tets, piece_.X, piece_.tet_mass)) {
  const auto& [tets, tet_mass, plastic_strain, material_id, X, x, v, node_mass, friction] = piece_;
  for (std::size_t n = 0; n < x.size(); ++n) {
    mass_ += node_mass[n];
    com_ += node_mass[n] * x[n];
    velocity_ += node_mass[n] * v[n];
  }
  com_ /= mass_;
  velocity_ /= mass_;
  for (std::size_t n = 0; n < x.size(); ++n) {
    const Vec3 r = x[n] - com_;
    r_.push_back(r);
    inertia_F_ += node_mass[n] * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
    L_ += node_mass[n] * r.cross(v[n]);
  }
  inverse_inertia_F_ = inertia_F_.inverse();
}

Mat3 RigidFragment::inertia() const {
  const Mat3 R = R_WF_.toRotationMatrix();
  return R * inertia_F_ * R.transpose();
}

Vec3 RigidFragment::angular_velocity() const { return R_WF_ * (inverse_inertia_F_ * (R_WF_.conjugate() * L_)); }

void RigidFragment::push(const Vec3& impulse, int node) {
  pushed_ += impulse;
  pushed_angular_ += (x()[node] - com_).cross(impulse);
}

contact::CollisionBody RigidFragment::collision_body(bool asleep) const {
  const contact::RigidMotion motion{.p_WC = com_, .v = velocity_, .w = angular_velocity(), .mass = mass_,
                                    .movable = !held_ && !asleep, .in_solve = true};
  return {.mesh = &collision_, .x = piece_.x, .rigid = motion, .friction = piece_.friction};
}

void RigidFragment::advance(const Vec3& v, const Vec3& w, double h) {
  if (held_) return;
  const Vec3 moved = com_ + h * v;
  if (!v.allFinite() || !w.allFinite() || !(moved.cwiseAbs().maxCoeff() < kMaxPosition)) return hold();
  L_ = inertia() * w;
  velocity_ = v;
  com_ = moved;
  const double angle = h * w.norm();
  if (angle > 0) R_WF_ = (Quat(Eigen::AngleAxisd(angle, w.normalized())) * R_WF_).normalized();
  for (std::size_t n = 0; n < r_.size(); ++n) piece_.x[n] = com_ + R_WF_ * r_[n];
}

void RigidFragment::stop() {
  velocity_.setZero();
  L_.setZero();
  forget_pushes();
}

void RigidFragment::hold() {
  held_ = true;
  stop();
}

void RigidFragment::hash(StateHash& hash) const {
  hash.add(std::span<const Vec3>(piece_.x));
  hash.add(velocity_);
  hash.add(L_);
  hash.add(static_cast<std::uint64_t>(held_));
}

}  // namespace crumple::sim
