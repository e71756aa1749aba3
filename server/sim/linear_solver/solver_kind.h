#pragma once

#include <cstdint>

namespace crumple::sim::linear_solver {

// How the system of an island is solved: conjugate gradients with one of these preconditioners, or directly.
enum class SolverKind : std::uint8_t {
  automatic,      // by size and stiffness of the island
  jacobi,         // block-Jacobi, the paper's (Parker & O'Brien 2009, section 4)
  rigid_modes,    // block-Jacobi, and rigid motions of whole pieces solved for at once
  multigrid,      // geometric multigrid on lattices over the rest shape
  warped_factor,  // a Cholesky factor of the body at rest, turned with its nodes; until the body breaks
  direct,         // a Cholesky factor of the whole system, in every pass; for reference
};

}  // namespace crumple::sim::linear_solver
