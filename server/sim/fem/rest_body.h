#pragma once

#include "common/error.h"
#include "server/sim/fem/corotational.h"
#include "server/sim/fem/fem_material.h"
#include "server/sim/fem/linear_tetrahedron.h"
#include "server/sim/fem/macro_element.h"
#include "server/sim/fem/material_region.h"
#include "server/sim/fem/pressure_patch.h"
#include "server/sim/mesh/tet_mesh.h"

#include <algorithm>
#include <cstdint>
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
  FemMaterial material;  // of every tet; of several materials that which says what goes for the whole body
  Lame lame;             // its constants as elements have them: of those in patches less than all of lambda (patch_lambda)
  // Of a body of several materials: the others, and which one each tet is of: 0 `material`, k others[k - 1]. A body of
  // one material has neither.
  struct Other {
    FemMaterial material;
    Lame lame;
  };
  std::vector<Other> others;
  std::vector<std::uint16_t> material_id;
  std::vector<Mat3> beta;          // D_u^-1, eq. 1 [1/m]
  std::vector<double> volume;      // V [m^3]
  std::vector<double> fill;        // [-]
  std::vector<Mat3> beta_clamped;  // beta', and D_u beta': both empty in a body without a clamped tet
  std::vector<Mat3> rest_gradient;
  std::vector<double> node_mass;  // lumped: rho fill V / 4 from each tet of the node [kg]
  std::vector<double> node_drag;  // the same times damping_mass [kg/s]; empty in a body of one material
  double mean_edge = 0;           // over the tets' edges [m]
  MacroElements macros;           // empty: the elements are the tets
  PressurePatches patches;        // of octahedra that are nearly incompressible

  int tet_count() const { return static_cast<int>(beta.size()); }
  int node_count() const { return static_cast<int>(node_mass.size()); }
  bool grouped() const { return !macros.empty(); }  // elements are groups of tets
  int point_count() const { return grouped() ? macros.count() : tet_count(); }  // where strain is: one an element
  bool heterogeneous() const { return !material_id.empty(); }
  int material_count() const { return 1 + static_cast<int>(others.size()); }
  FemMaterial& material_at(int id) { return id == 0 ? material : others[id - 1].material; }
  const FemMaterial& material_at(int id) const { return id == 0 ? material : others[id - 1].material; }
  const FemMaterial& material_of(int t) const { return heterogeneous() ? material_at(material_id[t]) : material; }
  const Lame& lame_of(int t) const {
    return !heterogeneous() || material_id[t] == 0 ? lame : others[material_id[t] - 1].lame;
  }
  double patch_lambda(int id) const;  // what patches of that material have of lambda, 0 if it makes none [Pa]
  double lambda_of_patch(int p) const { return patch_lambda(heterogeneous() ? material_id[patches.first_tet(p)] : 0); }
  // Corners of groups and patches, those of each after those of the one before.
  std::size_t corner_count() const { return macros.nodes.size() + patches.nodes.size(); }
  bool clamped(int t) const { return !beta_clamped.empty() && beta_clamped[t] != beta[t]; }
  bool yields() const;     // any of its materials
  bool breakable() const;  // any of its materials
  bool dusty() const;      // likewise
  double tet_mass(int t) const { return material_of(t).density * fill[t] * volume[t]; }  // [kg]
  double mass() const;              // [kg]
  // c_i = sqrt(fill / (9 V)) n_i [sqrt(m)]: the constant core of eq. 2 as its factors,
  // K_ij = Q (lambda c_i c_j^T + mu (c_i . c_j) I + mu c_j c_i^T) Q^T; rotating 4 factors costs a tenth of rotating 10 cached
  // products, and gives the forces too.
  Mat34 core(int t) const;
  Mat34 gradients(int t) const;     // g_a of F = sum x_a g_a^T, of the true basis [1/m]
  RestTet tet(int t) const;         // everything of one tet, by value
};

// clamp_limit: bound on the basis matrices' singular values [1/m]; 0: 20 / mean edge length of the mesh. regions: where
// the material is another one.
// Rejects what validate rejects of mesh, materials and regions, and a negative or non-finite limit.
Result<RestBody> make_rest_body(const TetMesh& mesh, const FemMaterial& material, double clamp_limit = 0,
                                std::span<const MaterialRegion> regions = {},
                                ElementKind element = ElementKind::linear_tetrahedra);

// Leaves the tets `kept`, ascending; node masses, groups and patches are the caller's to renew (follow_topology).
void keep_tets(RestBody& rest, std::span<const int> kept);
// The same of a copy.
RestBody part_of(const RestBody& rest, std::span<const int> tets);

// Lumped masses, drags, groups and patches anew, after tets got other node ids. tets: one a rest tet; ids in [0, node_count).
// Returns what regroup() does: empty where elements are tets.
std::vector<int> follow_topology(RestBody& rest, const std::vector<Tet>& tets, int node_count);

}  // namespace crumple::sim::fem
