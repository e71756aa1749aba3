#pragma once

#include "server/lab/stability/soft_trial.h"

#include <Eigen/SparseCore>

// Supports and loads of static answers.
namespace crumple::lab::stability {

// Dofs are held by springs that are stiffer than anything in K by eight orders: what gives is 1e-8.
void hold(const std::vector<int>& dofs, Eigen::SparseMatrix<double>& K);

// Of the trial's prescribed nodes.
std::vector<int> held_dofs(const SoftTrial& trial);

// A uniform traction of total force `total` [N] on the surface at x = `side`, as 3n nodal forces.
Eigen::VectorXd traction(const sim::TetMesh& mesh, double side, const Vec3& total);

}  // namespace crumple::lab::stability
