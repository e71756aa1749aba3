#pragma once

#include "common/types.h"
#include "server/sim/contact/collision_mesh.h"
#include "server/sim/contact/detect.h"
#include "server/sim/state_hash.h"

#include <cstdint>
#include <vector>

namespace crumple::sim {

// A small piece of a broken finite-element body that goes on as a rigid one, as six unknowns of the same solve: no more
// than the scene needs. Linear backward Euler, besides, inflates small tets that turn by a radian in a step.
//
// It has the nodes, masses and shape that the piece had when it was handed over: position, momentum and angular momentum
// stay, to rounding; what is lost is the energy of its inner motion.
class RigidFragment {
 public:
  // The piece when it is handed over. Node ids are its own, 0 .. X.size() - 1.
  struct Piece {
    std::vector<Tet> tets;
    std::vector<double> tet_mass;            // [kg]
    std::vector<Mat3> plastic_strain;        // one a tet, kept for recordings
    std::vector<std::uint16_t> material_id;  // likewise; empty in a body of one material
    std::vector<Vec3> X;                     // rest positions in the body's axes [m]
    std::vector<Vec3> x, v;                  // in W [m], [m/s]
    std::vector<double> node_mass;           // [kg]
    double friction = 0.5;                   // mu [-]
  };
  explicit RigidFragment(Piece piece);

  const Piece& piece() const { return piece_; }      // x: where the nodes are now; v: see node_velocity
  const std::vector<Vec3>& x() const { return piece_.x; }
  Vec3 node_velocity(int node) const { return velocity_ + angular_velocity().cross(x()[node] - com_); }
  int node_count() const { return static_cast<int>(r_.size()); }

  double mass() const { return mass_; }               // [kg]
  const Vec3& com() const { return com_; }            // in W [m]
  const Vec3& velocity() const { return velocity_; }  // of the centre of mass [m/s]
  Vec3 angular_velocity() const;                      // in W [rad/s]
  const Vec3& angular_momentum() const { return L_; } // about the centre of mass [kg m^2/s]
  Mat3 inertia() const;                               // about the centre of mass, in W [kg m^2]
  double kinetic_energy() const { return 0.5 * (mass_ * velocity_.squaredNorm() + angular_velocity().dot(L_)); }
  bool is_held() const { return held_; }              // for good, where it is

  // A push on a node, to be taken in by the next solve: `pushed` and `pushed_angular` (about the centre of mass) sum up.
  void push(const Vec3& impulse, int node);
  void forget_pushes() { pushed_ = pushed_angular_ = Vec3::Zero(); }
  const Vec3& pushed() const { return pushed_; }                  // [N s]
  const Vec3& pushed_angular() const { return pushed_angular_; }  // [N m s]

  const contact::CollisionMesh& mesh() const { return collision_; }  // of piece().tets
  // As contact sees it: movable unless it is held or `asleep`. Borrows this object.
  contact::CollisionBody collision_body(bool asleep) const;

  // v and w are the velocities that a solve over h [s] found; moves on with them. The angular momentum stays I w of the
  // solve while the body turns. Velocities that are not finite, or that lead out of the range of positions, hold it.
  void advance(const Vec3& v, const Vec3& w, double h);
  void stop();
  void hold();

  void hash(StateHash& hash) const;

 private:
  Piece piece_;
  contact::CollisionMesh collision_;
  double mass_ = 0;
  std::vector<Vec3> r_;                   // of the nodes from the centre of mass, in the fragment's axes F: W's at hand-over
  Mat3 inertia_F_ = Mat3::Zero(), inverse_inertia_F_;

  Quat R_WF_ = Quat::Identity();
  Vec3 com_ = Vec3::Zero(), velocity_ = Vec3::Zero(), L_ = Vec3::Zero();
  Vec3 pushed_ = Vec3::Zero(), pushed_angular_ = Vec3::Zero();
  bool held_ = false;
};

}  // namespace crumple::sim
