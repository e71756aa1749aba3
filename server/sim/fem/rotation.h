#pragma once

#include "common/types.h"
#include "server/sim/fem/fem_material.h"

// The rotation Q that is factored out of a deformation gradient F. det Q = +1 for every F, also mirrored, flat or zero
// ones; F that is not finite gives I.
namespace crumple::sim::fem {

// Below this det F (volume over reference volume) the paper's rule leaves the polar decomposition for QR (section 3).
inline constexpr double kQrVolumeRatio = 0.06;

// Q = U V^T of the SVD F = U D V^T with det U = det V = +1, so that for det F < 0 the smallest singular value carries
// the sign (Irving et al. 2004). Where F has rank 2 the third axes are cross products; rank 1: the smallest rotation
// that takes v_1 to u_1; F = 0: I.
Mat3 svd_rotation(const Mat3& F);

// The closed form of polar_factor.h where det F is well above 0, else svd_rotation, which it equals there.
Mat3 polar_rotation(const Mat3& F);

// Q of F = Q R, R upper triangular, by Gram-Schmidt; q_3 = q_1 x q_2 keeps det Q = +1 and lets R_33 carry the sign.
// Where the first two columns are dependent: svd_rotation.
Mat3 qr_rotation(const Mat3& F);

// The rule of a material (DESIGN decision 2): svd, or polar with QR below kQrVolumeRatio.
Mat3 rotation(const Mat3& F, RotationRule rule);

}  // namespace crumple::sim::fem
