#pragma once

#include "server/sim/fem/corotational.h"

#include <array>
#include <cstdint>
#include <optional>

namespace crumple::sim::fem {

using Mat38 = Eigen::Matrix<double, 3, 8>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

// The hexahedron of eight nodes with incompatible modes (Wilson et al. 1973; Taylor, Beresford & Wilson 1976): to the trilinear
// displacement it adds 1 - xi^2, 1 - eta^2 and 1 - zeta^2 in each direction, which are found by its own balance. A trilinear
// box that is bent stretches and shears, and locks; this one bends, as Euler and Bernoulli's beam does where it is a box.
//
// Co-rotated, it is the mean deformation gradient F, with the law and the rotation Q of F, and beside it what F does not see:
//
//   E = V psi(Q^T F) + 1/2 sum_ab Y_a . H_ab Y_b,   Y_a = Q^T x_a
//
// H = P^T K P, of rank 12: K is the element's stiffness at rest, P takes away the affine part by the tets' mean gradient, so that the patch
// test holds in any shape. Of a box, whose corners the tets' mean weighs by 1/3 and 1/6 instead of 1/4, every mode of bending and twist
// is the element's; xi eta zeta alone is three times as stiff. Corner a is at xi = (-1 or 1 by bit 0 of a), eta by bit 1, zeta by bit 2.
struct HexahedronShape {
  std::array<Mat3, 64> H;  // H_ab at 8 a + b, rest axes [N/m]
  // Of each of its six tets: what Y adds to the mean strain at the tet's centroid; xx, yy, zz, xy, yz, zx, the latter twice
  // the tensor's [1/m].
  std::array<Eigen::Matrix<double, 6, 24>, 6> deviation;
  double spectral_bound = 0;  // no eigenvalue of its whole stiffness is above so many times its block diagonal's

  std::array<Vec3, 8> forces(const Mat38& Y) const;             // sum_b H_ab Y_b [N]
  Mat3 strain_deviation(int tet, const Mat38& Y) const;         // [-]
};

// By local corners, four a tet.
using HexahedronTets = std::array<std::array<std::uint8_t, 4>, 6>;

double trilinear_volume(const Mat38& X);  // [m^3]

// X: rest positions in the columns [m]; g: g_a of F = sum x_a g_a^T [1/m]; filled: volume of the tets that is material [m^3], share: of theirs.
// None where the cell is too far from a box for its modes: its Jacobian falls below kFlattest of the centre's.
inline constexpr double kFlattest = 0.2;
std::optional<HexahedronShape> hexahedron_shape(const Mat38& X, const Mat38& g, const HexahedronTets& tets, const Lame& lame,
                                                double filled, double share);

}  // namespace crumple::sim::fem
