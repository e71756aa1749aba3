#pragma once

#include "server/sim/contact/contact_rows.h"

#include <span>

// Friction of a contact from the weight of its island instead of from its own normal force
// [Parker & O'Brien 2009, section 6]:
//   F_n = M_island G mu r_y alpha,
// r_y the component of the contact normal against gravity, alpha the contact's share of the overlap volume of the island's
// contacts. It is known before the solve, acts against the tangential velocity w and is linear in it: a damper, so its
// term is symmetric and takes energy whatever happens.
//
// The paper gives the force a magnitude, F_n, and says that it is proportional to w; it does not print the speed at which
// it is F_n. Here that is the speed with which the step starts, w_0: lambda_t = -c_t w, c_t = min(c_n, dt F_n / |w_0|). A
// block that slides then decelerates by mu G as Coulomb's does. (F_n taken as N per 1 m/s would let it slide on for ever and
// creep on a slope at tan(slope) / mu metres a second.) Nothing sticks: what rests on a slope creeps by what c_n lets through.
// The paper's static friction, a PID controller whose constants it does not print, is not reproduced.
namespace crumple::sim::contact {

// dt F_n / (M_island alpha) [m/s]: ContactRow::weight_speed.
double weight_speed(double mu, const Vec3& normal, const Vec3& gravity, double dt);

// Before each pass. The rows of one island of `mass` [kg], with their u before the step: sets c_t of those that have a
// weight_speed. Only active rows have a share alpha.
void set_weight_friction(double mass, std::span<const Vec3> u, std::span<ContactRow> rows);

}  // namespace crumple::sim::contact
