#pragma once

#include "server/sim/fem/macro_states.h"
#include "server/sim/quad.h"

#include <array>

// What hexahedra do besides what their mean does (hexahedron.h): the part of MacroStates that is theirs alone. d: one of them.
namespace crumple::sim::fem {

// The hourglass forces: on the corners, in its own axes, and what balances their moment. Those of Q H Y alone have one,
// m = sum Y_a x (H Y)_a, wherever H is not the same in all directions; -dE/dx has none, since Q turns with F:
//   dQ = Q [w], (tr(S) I - S) w = axial(Q^T dF), so that the energy's derivative has the stress -[(tr(S) I - S)^-1 m] / V besides.
struct HexahedronForces {
  std::array<Vec3, 8> corner;  // [N]
  Mat3 stress;                 // [Pa]
};
HexahedronForces hexahedron_forces(const MacroElements& m, int d, const Mat38& Y, const Mat3& S);  // S = sym(Q^T F)
Mat38 local_corners(const MacroElements& m, int d, const std::vector<Vec3>& x, const Mat3& Q);     // Y_a = Q^T (x_a - x_0) [m]
double hexahedron_energy(const MacroElements& m, int d, const Mat38& Y);                           // 1/2 sum Y_a . H_ab Y_b [J]
// J^T H J, J = dY/dx with dQ/dF: dY_a = Q^T dx_a - w x Y_a, w of all corners' dx as above [N/m].
Eigen::Matrix<double, 24, 24> exact_hexahedron_stiffness(const MacroElements& m, int d, const Mat38& Y, const Mat3& Q, const Mat3& F);

// Whether tet t is in one that is not split; then its own stress at the centroid, in world axes [Pa], and Q n_i by its true basis, times
// fill [m^2].
bool in_hexahedron(const MacroElements& m, const MacroStates& states, int t);
Mat3 hexahedron_stress(const RestBody& rest, const MacroStates& states, int t);
Mat34 hexahedron_normals(const RestBody& rest, const MacroStates& states, int t);

inline bool of_hexahedron(const MacroElements& m, int corner) { return corner < 8 * m.hexahedra; }
// Adds factor Q H_ab Q^T of corners a and b of one hexahedron, nothing if it is split.
void add_hexahedron_block(const MacroElements& m, const MacroStates& states, int a, int b, double factor, Quad (&block)[3]);
// What tension stiffens between them, as a string's does across it: V g_a . tension g_b, times the identity [N/m]. The law's K has Q
// frozen and does not see it; a thin body that is pulled then swings across faster than a step follows, and the swing grows: a pane of
// 1 cm in cells of 10 cm burst at 0.7 % of strain. (Linear tets of that size lock across, so that they do not.) With it f(x) - K dx also turns
// with the body. Compression would take stiffness away and is left out: positive semi-definite.
inline double tension_stiffness(const MacroStates& states, int a, int b) { return states.core[a].dot(states.tension[a / 8] * states.core[b]); }

}  // namespace crumple::sim::fem
