#pragma once

#include "common/error.h"
#include "server/sim/fem/corotational.h"
#include "server/sim/fem/fem_material.h"
#include "server/sim/fem/linear_tetrahedron.h"
#include "server/sim/mesh/tet_mesh.h"

#include <string>
#include <vector>

namespace crumple::sim::fem {

// Upper limits of what a material may say.
inline constexpr double kMaxYoung = 1e13;   // [Pa]
inline constexpr double kMaxDensity = 1e7;  // [kg/m^3]
inline constexpr double kMaxDamping = 1e6;  // of both Rayleigh coefficients [1/s], [s]

// Rejects what is not finite (yield and toughness may be infinite), outside the ranges of fem_material.h or above the
// limits; `field` prefixes the error's path.
Result<void> validate(const FemMaterial& material, const std::string& field);

// Constant data of one finite-element body, one array a quantity, indexed by tet. Rest geometry of a tet does not
// change when fracture renumbers its nodes; only node_mass does (update_node_mass).
struct RestBody {
  FemMaterial material;
  Lame lame;
  std::vector<Mat3> beta;          // D_u^-1, eq. 1 [1/m]
  std::vector<Mat34> core;         // c_i = sqrt(fill / (9 V)) n_i [sqrt(m)]: the constant core of eq. 2 as its factors,
                                   // K_ij = Q (lambda c_i c_j^T + mu (c_i . c_j) I + mu c_j c_i^T) Q^T; rotating 4
                                   // factors costs a tenth of rotating 10 cached products, and gives the forces too
  std::vector<double> volume;      // V [m^3]
  std::vector<double> fill;        // [-]
  std::vector<Mat3> beta_clamped;  // beta', and D_u beta': both empty in a body without a clamped tet
  std::vector<Mat3> rest_gradient;
  std::vector<double> node_mass;  // lumped: rho fill V / 4 from each tet of the node [kg]
  double mean_edge = 0;           // over the tets' edges [m]

  int tet_count() const { return static_cast<int>(beta.size()); }
  int node_count() const { return static_cast<int>(node_mass.size()); }
  double mass() const;              // [kg]
  RestTet tet(int t) const;         // everything of one tet, by value
  Vec3 normal(int t, int i) const;  // n_i [m^2]
};

// clamp_limit: bound on the basis matrices' singular values [1/m]; 0: 20 / mean edge length of the mesh.
// Rejects what validate(TetMesh) and validate(FemMaterial) reject, and a negative or non-finite limit.
Result<RestBody> make_rest_body(const TetMesh& mesh, const FemMaterial& material, double clamp_limit = 0);

// Lumped masses anew, after tets got other node ids. tets: one a rest tet; ids in [0, node_count).
void update_node_mass(RestBody& rest, const std::vector<Tet>& tets, int node_count);

}  // namespace crumple::sim::fem
