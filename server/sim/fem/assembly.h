#pragma once

#include "server/sim/fem/connectivity.h"
#include "server/sim/fem/elements.h"
#include "server/sim/linear_solver/block_sparse_matrix.h"

#include <cstdint>
#include <span>
#include <variant>

namespace crumple::sim::fem {

// A node whose velocity in the coming step is given: held fixed, or driven by a script.
struct PrescribedNode {
  int node = 0;
  Vec3 velocity = Vec3::Zero();  // [m/s]
};

// A formula of time integration, as what it says of v+ and x+,
//   c M v+ = M w + dt (f_ext + f(x+) - C v+),   x+ = x_known + theta dt v+,
// C = a M + beta K, of each tet with the coefficients of its material; the elastic force f is linearised at x_linear.
// Backward Euler: c = theta = 1, w = v, x_known = x_linear = x. bdf2.h has another one. Everything is borrowed.
// Impulses of contact rows are those of the whole step whatever c is: they are added to the system as they are.
struct StepFormula {
  double dt = 0;                       // [s]
  double mass = 1;                     // c [-]
  double position = 1;                 // theta [-]
  const std::vector<Vec3>& w;          // one a node [m/s]
  const std::vector<Vec3>& x_known;    // [m]; of prescribed nodes such that x+ is x + dt v+
  const std::vector<Vec3>& x_linear;   // [m]
};

StepFormula backward_euler_formula(const FemState& state, double dt);

// The linear system A v+ = b of one body and one step,
//   A = (c + dt a) M + (dt beta + theta dt^2) K,   b = M w + dt (f_ext + f(x_linear) - K (x_known - x_linear));
// for backward Euler that is Parker & O'Brien 2009, eq. 5: A = M + dt C + dt^2 K, b = M v + dt (f_ext + f(x)), where the
// elastic force at x, plastic strain included, stands for the paper's -K (x - u).
// Of hexahedra theta dt^2 times what tension stiffens is in A as well, and in b (tension_stiffness).
// Prescribed nodes are struck (section 7): their columns times their velocities are on the right-hand side, and their
// own rows read m v = m v_prescribed, coupled to nothing. Whoever adds terms to the system must add none to those rows.
class StepSystem {
 public:
  explicit StepSystem(bool float_matrix = false);  // precision of the off-diagonal blocks

  int node_count() const { return static_cast<int>(row_mass.size()); }

  // y = A x; x, y: 3n, node-major; segments of longer vectors are welcome.
  void multiply(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> y, const ThreadPool& pool) const;
  void multiply_rows(int begin, int end, const double* x, double* y) const;  // those nodes of y alone
  const std::vector<Mat3>& diagonal() const;  // diagonal blocks of A, one a node
  Eigen::SparseMatrix<double> to_sparse() const;

  Eigen::VectorXd b;             // 3n [N s]; callers may add to it
  Eigen::VectorXd guess;         // 3n: v, with prescribed velocities in place. A solve must start from it, or
                                 // from anything that has the prescribed velocities in place. (From 2 v - v_before BDF2
                                 // needs a quarter fewer iterations, and what the tolerance leaves of that adds 1 % to
                                 // the energy of a turning body in 0.2 s; what it leaves of v takes some away.
                                 // Held bodies start better: islands/projected_start.h.)
  std::vector<double> row_mass;  // (c + dt a) m, one a node [kg]
  std::vector<char> prescribed;  // one a node
  bool any_prescribed = false;
  Elements elements;  // at x_linear, as update_elements leaves them; forces: f(x_linear) - K (x_known - x_linear)
  Connectivity connectivity;
  std::variant<linear_solver::BlockSparseMatrix<double>, linear_solver::BlockSparseMatrix<float>> A;
  std::vector<int> piece;        // one a node: which connected part of the pattern it is in; by their lowest node
  int piece_count = 0;
  int largest_piece = 0;         // [nodes]
  std::vector<std::array<int, 2>> edge_blocks;  // of each edge (i, j): index of block (i, j) and of block (j, i)
  // Of a body of several materials or with pressure patches: which weights are each corner's. Weights are constants times
  // (dt beta + theta dt^2), one a material, then one a material of what its patches have.
  struct Weights {
    Lame lame;
    double stiffness = 0;
  };
  std::vector<std::uint16_t> corner_weights;
  std::vector<Weights> weights;
  // Of the formula that it was assembled by.
  struct Scale {
    double dt = 0, mass = 0, position = 0;
    bool operator==(const Scale&) const = default;
  };
  Scale scale;
  std::vector<Tet> tets;    // of which connectivity and pattern were made
  // No eigenvalue of A is above so many times its block diagonal's. Of elements of k nodes k is proved: 4 of tets, and what the
  // largest pressure patch has; of hexahedra what one by itself has
  // (HexahedronShape). Of smoothed octahedra by themselves up to 3.9 was measured.
  double spectral_bound = 4;
  bool with_split = false;  // connectivity has the corners of tets after those of groups and patches
};

// Assembles the step from x(t), v(t) to t + dt. f_ext: 3n, gravity and all [N]. rest.node_mass must be that of `tets`.
// With dt in place of a formula: backward Euler.
// Arrays and pattern are rebuilt when tets or the number of nodes differ from the last call's, or when the first tet of a
// group comes to stand for itself, or the last no longer does; else nothing allocates.
// Deterministic for any number of threads: the element pass writes per tet, edges and nodes gather in mesh order.
void assemble(const RestBody& rest, const std::vector<Tet>& tets, const FemState& state,
              Eigen::Ref<const Eigen::VectorXd> f_ext, double dt, std::span<const PrescribedNode> prescribed,
              const ThreadPool& pool, StepSystem& system);
void assemble(const RestBody& rest, const std::vector<Tet>& tets, const FemState& state, const StepFormula& formula,
              Eigen::Ref<const Eigen::VectorXd> f_ext, std::span<const PrescribedNode> prescribed,
              const ThreadPool& pool, StepSystem& system);

// Adds the one velocity to all nodes that makes the sum of the equations hold: rows of K sum to zero, so the exact
// solution has sum row_mass v+ = sum b, which an unconverged one misses. Only for a body that nothing else holds: no
// prescribed node (then it does nothing), no contact row. v: 3n.
void remove_net_momentum_error(const StepSystem& system, Eigen::Ref<Eigen::VectorXd> v);

}  // namespace crumple::sim::fem
