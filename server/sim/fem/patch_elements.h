#pragma once

#include "server/sim/fem/rest_body.h"
#include "server/sim/parallel_for.h"

#include <Eigen/SparseCore>

#include <span>
#include <vector>

namespace crumple::sim::fem {

// What pressure patches do at given node positions (pressure_patch.h). One a patch.
struct PatchElements {
  std::vector<Mat3> Q;
  std::vector<double> pressure;  // lambda theta; positive: pulled [Pa]
};

// core, force: of the patches' corners, Q c_a and f_a [N]. plastic_strain: one an octahedron.
void update_patches(const RestBody& rest, const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain, const ThreadPool& pool,
                    PatchElements& elements, std::span<Vec3> core, std::span<Vec3> force);

double patch_energy(const RestBody& rest, const PatchElements& elements);            // [J]
double patch_pressure(const RestBody& rest, const PatchElements& elements, int t);   // at tet t; 0 if it is in none [Pa]

// Entries of -df/dx. core: as update_patches left them. exact: with dQ/dF.
void add_patch_stiffness(const RestBody& rest, const std::vector<Vec3>& x, const PatchElements& elements, std::span<const Vec3> core,
                         bool exact, std::vector<Eigen::Triplet<double>>& entries);

}  // namespace crumple::sim::fem
