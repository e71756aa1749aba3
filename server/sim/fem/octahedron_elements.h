#pragma once

#include "server/sim/fem/patch_elements.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/parallel_for.h"

#include <Eigen/SparseCore>

#include <vector>

namespace crumple::sim::fem {

// What the smoothed octahedra of a body do at given node positions: what Elements is for plain tets, which are empty
// then. Passes as in elements.h.
struct OctahedronElements {
  // One an octahedron.
  std::vector<Mat3> Q;
  std::vector<Mat3> sigma;           // [Pa]
  std::vector<Vec3> z;               // of the hourglass forces [sqrt(J)]
  std::vector<char> split;           // its tets stand for themselves: one is near inversion or clamped
  bool any_split = false;
  PatchElements patches;
  // One a corner, of octahedra, then of patches; if any_split, then four a tet, of those that stand for themselves, the others' zero.
  std::vector<Vec3> force;           // [N]
  std::vector<Vec3> core;            // Q c_a
  // One a tet; only if any_split.
  std::vector<double> tet_share;     // of it that stands for itself: 0, 1/2, 1
  std::vector<Mat3> tet_Q, tet_sigma;
};

// plastic_strain: one an octahedron; that of a tet is the mean of its two.
void update_octahedra(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                      const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, OctahedronElements& elements);

// As plastic_flow: octahedra flow, also where their tets stand for themselves.
void flow_octahedra(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                    std::span<const double> creep, const ThreadPool& pool, std::vector<Mat3>& plastic_strain,
                    OctahedronElements& elements);

// Stress in world axes of a tet [Pa]: of its octahedra, by halves, or its own; and the pressure of its patch.
Mat3 tet_stress(const RestBody& rest, const OctahedronElements& elements, int t);
// Q n_i of a tet with the mean of its octahedra's rotations, times fill [m^2].
Mat34 tet_normals(const RestBody& rest, const OctahedronElements& elements, int t);
Mat3 tet_plastic_strain(const RestBody& rest, const std::vector<Mat3>& plastic_strain, int t);

double octahedron_energy(const RestBody& rest, const OctahedronElements& elements);  // [J]
void add_octahedron_forces(const RestBody& rest, const std::vector<Tet>& tets, const OctahedronElements& elements,
                           Eigen::Ref<Eigen::VectorXd> f);  // f: 3n [N]
// Entries of -df/dx at the positions of the elements' last update. exact: with dQ/dF.
void add_octahedron_stiffness(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                              const std::vector<Mat3>& plastic_strain, bool exact, const OctahedronElements& elements,
                              std::vector<Eigen::Triplet<double>>& entries);

}  // namespace crumple::sim::fem
