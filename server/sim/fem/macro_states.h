#pragma once

#include "server/sim/fem/patch_elements.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/parallel_for.h"

#include <Eigen/SparseCore>

#include <vector>

namespace crumple::sim::fem {

// What a body's elements of several tets do at given node positions: what Elements is for plain tets, which are empty
// then. Passes as in elements.h.
struct MacroStates {
  // One an element.
  std::vector<Mat3> Q;
  std::vector<Mat3> sigma;           // [Pa]
  std::vector<Vec3> z;               // of octahedra: of the hourglass forces [sqrt(J)]
  std::vector<char> split;           // its tets stand for themselves: one is near inversion or clamped
  bool any_split = false;
  std::vector<Mat38> Y;              // of hexahedra: Q^T (x_a - x_0) [m]
  std::vector<Mat3> tension;         // of hexahedra: the tensile part of Q sigma Q^T [Pa]; zero of those that are split
  PatchElements patches;
  // One a corner, of elements, then of patches; if any_split, then four a tet, of those that stand for themselves, the others' zero.
  std::vector<Vec3> force;           // [N]
  std::vector<Vec3> core;            // Q c_a
  // One a tet; only if any_split.
  std::vector<double> tet_share;     // of it that stands for itself: 0, 1/2, 1
  std::vector<Mat3> tet_Q, tet_sigma;
};

// plastic_strain: one an element; that of a tet is the mean of its two.
void update_macros(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                   const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, MacroStates& elements);

// As plastic_flow: elements flow, also where their tets stand for themselves.
void flow_macros(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                 std::span<const double> creep, const ThreadPool& pool, std::vector<Mat3>& plastic_strain,
                 MacroStates& elements);

// Stress in world axes of a tet [Pa]: of its octahedra, by halves, its hexahedron at the tet's centroid, or its own; and the pressure
// of its patch.
Mat3 tet_stress(const RestBody& rest, const MacroStates& elements, int t);
// Q n_i of a tet with the mean of its elements' rotations, times fill [m^2].
Mat34 tet_normals(const RestBody& rest, const MacroStates& elements, int t);
Mat3 tet_plastic_strain(const RestBody& rest, const std::vector<Mat3>& plastic_strain, int t);

double macro_energy(const RestBody& rest, const MacroStates& elements);  // [J]
void add_macro_forces(const RestBody& rest, const std::vector<Tet>& tets, const MacroStates& elements,
                      Eigen::Ref<Eigen::VectorXd> f);  // f: 3n [N]
// Entries of -df/dx at the positions of the elements' last update. exact: with dQ/dF, but for the
// curvature of Q times the hourglass forces of hexahedra, which is small while those are small.
void add_macro_stiffness(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                         const std::vector<Mat3>& plastic_strain, bool exact, const MacroStates& elements,
                         std::vector<Eigen::Triplet<double>>& entries);

}  // namespace crumple::sim::fem
