#pragma once

#include "server/sim/example_based/example_rest.h"
#include "server/sim/parallel_for.h"

#include <span>

// Skinning with spatially varying example weights, Jones et al. 2016, section 3.1, and its derivative, eq. 5.
//   linear blend skinning      x_i = sum_b W_ib T_b u_i                          [eq. 1]
//   T_b blends the examples    x_i = sum_b W_ib (sum_e E_ie T_be) u_i            [eq. 2]
//   rotations blend by QLERP   x_i = sum_b W_ib QLERP(E_i, T_b) u_i              [eq. 3]
//     QLERP(E_i, T_b) u = R(Q / |Q|) u + sum_e E_ie t_be,   Q = sum_e E_ie s_be q_be,   about the asset's origin.
namespace crumple::sim::example_based {

using WeightRow = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxExamples, 1>;  // E entries: E_i, de_i; on the stack
using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxExamples>;   // 3 x E, on the stack

// Eq. 3 for vertex i with example weights `row` (E entries) [m]. The rest row gives x_rest[i] as it stands, and a bone
// that no example turns costs no blend of quaternions.
Vec3 skin_vertex(const ExampleRest& rest, int i, const WeightRow& row);

// Eq. 1 with T_b = T_be: vertex i with the whole body in example e [m].
Vec3 skin_in_example(const ExampleRest& rest, int i, int e);

// Eq. 3 for the listed vertices. E: N x E. x: N [m]. Returns whether any bit of x changed.
bool skin(const ExampleRest& rest, const WeightMatrix& E, std::span<const int> vertices, const ThreadPool& pool,
          std::span<Vec3> x);

// J_i = d x_i / d E_ie [m], eq. 5: every E_ie an independent variable, the rest pose's included, exact through QLERP's
// normalisation. (The paper differentiates automatically; here it is done by hand.)
Jacobian skinning_jacobian(const ExampleRest& rest, int i, const WeightRow& row);

}  // namespace crumple::sim::example_based
