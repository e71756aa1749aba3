#include "server/sim/fem/assembly.h"

#include "server/sim/fem/quad.h"

#include <cassert>
#include <functional>

namespace crumple::sim::fem {

using linear_solver::BlockSparseMatrix;

namespace {

constexpr int kTetsPerChunk = 256;
constexpr int kEdgesPerChunk = 512;
constexpr int kNodesPerChunk = 256;

void rebuild(int node_count, const std::vector<Tet>& tets, StepSystem& s) {
  s.connectivity = make_connectivity(node_count, tets);
  std::visit(
      [&]<class Scalar>(BlockSparseMatrix<Scalar>& A) {
        A = BlockSparseMatrix<Scalar>::from_tets(node_count, tets);
        s.edge_blocks.clear();
        for (const auto& [i, j] : s.connectivity.edges) s.edge_blocks.push_back({A.find(i, j), A.find(j, i)});
      },
      s.A);
  s.b.resize(3 * node_count);
  s.guess.resize(3 * node_count);
  s.row_mass.resize(node_count);
  s.prescribed.resize(node_count);
}

// What scales the parts of A.
struct Factors {
  double mass;       // c + dt a
  double stiffness;  // dt beta + theta dt^2
};

Factors factors_of(const FemMaterial& material, const StepFormula& formula) {
  const double dt = formula.dt;
  return {formula.mass + dt * material.damping_mass,
          dt * material.damping_stiffness + formula.position * dt * dt};
}

// Forces at x_linear become f(x_linear) - K (x_known - x_linear). With D = sum d_j c_j^T over displacements d_j eq. 2's
// product is K d = (lambda tr(D) I + mu (D + D^T)) c_i.
void shift_forces(const RestBody& rest, const std::vector<Tet>& tets, const StepFormula& formula,
                  const ThreadPool& pool, Elements& e) {
  const auto body = [&](int begin, int end) {
    for (int t = begin; t < end; ++t) {
      const Lame& lame = rest.lame_of(t);
      const Mat34 d = gather(formula.x_known, tets[t]) - gather(formula.x_linear, tets[t]);
      const Mat3 D = edge_matrix(d) * e.core[t].rightCols<3>().transpose();
      const Mat3 stress = lame.lambda * D.trace() * Mat3::Identity() + lame.mu * (D + D.transpose());
      e.force[t].rightCols<3>() -= stress * e.core[t].rightCols<3>();
      e.force[t].col(0) = -e.force[t].rightCols<3>().rowwise().sum();
    }
  };
  pool.for_chunks(rest.tet_count(), kTetsPerChunk, std::cref(body));
}

// Off-diagonal block of an edge from its tets. With G = sum c_a c_b^T eq. 2's sum is lambda G + mu tr(G) I + mu G^T.
Mat3 edge_stiffness(const StepSystem& s, const Lame& lame, int edge) {
  Quad sum[3] = {Quad{}, Quad{}, Quad{}};  // columns of G
  for (int k = s.connectivity.edge_start[edge]; k < s.connectivity.edge_start[edge + 1]; ++k) {
    const int corner = s.connectivity.edge_corners[k];
    const double* c = s.elements.core[corner >> 4].data();
    const Quad a = load_three(c + 3 * ((corner >> 2) & 3));
    const double* b = c + 3 * (corner & 3);
    for (int j = 0; j < 3; ++j) sum[j] += a * b[j];
  }
  const Mat3 G = to_matrix(sum);
  return lame.lambda * G + lame.mu * (G.trace() * Mat3::Identity() + G.transpose());
}

// The same where tets are of several materials: G is summed with the weights of each tet's own, factors and all.
Mat3 weighted_edge_stiffness(const StepSystem& s, const std::vector<std::uint16_t>& material_id, int edge) {
  Quad of_lambda[3] = {Quad{}, Quad{}, Quad{}}, of_mu[3] = {Quad{}, Quad{}, Quad{}};  // columns
  for (int k = s.connectivity.edge_start[edge]; k < s.connectivity.edge_start[edge + 1]; ++k) {
    const int corner = s.connectivity.edge_corners[k];
    const double* c = s.elements.core[corner >> 4].data();
    const Lame& weight = s.weights[material_id[corner >> 4]];
    const Quad a = load_three(c + 3 * ((corner >> 2) & 3));
    const double* b = c + 3 * (corner & 3);
    for (int j = 0; j < 3; ++j) {
      of_lambda[j] += a * (weight.lambda * b[j]);
      of_mu[j] += a * (weight.mu * b[j]);
    }
  }
  const Mat3 G_lambda = to_matrix(of_lambda), G_mu = to_matrix(of_mu);
  return G_lambda + G_mu.trace() * Mat3::Identity() + G_mu.transpose();
}

void set_weights(const RestBody& rest, const StepFormula& formula, StepSystem& s) {
  s.weights.resize(rest.material_count());
  for (int k = 0; k < rest.material_count(); ++k) {
    const Lame& lame = k == 0 ? rest.lame : rest.others[k - 1].lame;
    const double stiffness = factors_of(rest.material_at(k), formula).stiffness;
    s.weights[k] = {stiffness * lame.lambda, stiffness * lame.mu};
  }
}

template <class Scalar>
void assemble_edges(const RestBody& rest, const Factors& factors, StepSystem& s, BlockSparseMatrix<Scalar>& A,
                    int begin, int end) {
  for (int edge = begin; edge < end; ++edge) {
    const Mat3 block = rest.heterogeneous() ? weighted_edge_stiffness(s, rest.material_id, edge)
                                            : factors.stiffness * edge_stiffness(s, rest.lame, edge);
    A.set_block(s.edge_blocks[edge][0], block);
    A.set_block(s.edge_blocks[edge][1], block.transpose());
  }
}

Vec3 gather_force(const StepSystem& s, int node) {
  Vec3 f = Vec3::Zero();
  for (int k = s.connectivity.node_start[node]; k < s.connectivity.node_start[node + 1]; ++k) {
    const int corner = s.connectivity.node_corners[k];
    f += s.elements.force[corner >> 2].col(corner & 3);
  }
  return f;
}

// Diagonal block of a row: the stiffness of a row sums to zero, since a translation strains nothing. Summed from the
// blocks as stored, so that it stays zero in float as well.
template <class Scalar>
Mat3 row_diagonal(const BlockSparseMatrix<Scalar>& A, double row_mass, int row) {
  Mat3 sum = Mat3::Zero();
  for (int k = A.row_start()[row]; k < A.row_start()[row + 1]; ++k) sum -= A.block(k).template cast<double>();
  return symmetric_part(sum) + row_mass * Mat3::Identity();
}

// Section 7: the known velocities' terms go to the right-hand side, then the row or column is struck.
template <class Scalar>
void strike(StepSystem& s, BlockSparseMatrix<Scalar>& A, int row) {
  for (int k = A.row_start()[row]; k < A.row_start()[row + 1]; ++k) {
    const int col = A.columns()[k];
    if (!s.prescribed[row] && !s.prescribed[col]) continue;
    if (!s.prescribed[row]) s.b.segment<3>(3 * row) -= A.block(k).template cast<double>() * s.guess.segment<3>(3 * col);
    A.set_block(k, Mat3::Zero());
  }
  if (!s.prescribed[row]) return;
  A.diagonal()[row] = s.row_mass[row] * Mat3::Identity();
  s.b.segment<3>(3 * row) = s.row_mass[row] * s.guess.segment<3>(3 * row);
}

void set_prescribed(const FemState& state, std::span<const PrescribedNode> prescribed, StepSystem& s) {
  for (int i = 0; i < s.node_count(); ++i) s.guess.segment<3>(3 * i) = state.v[i];
  std::fill(s.prescribed.begin(), s.prescribed.end(), char{0});
  for (const PrescribedNode& p : prescribed) {
    assert(p.node >= 0 && p.node < s.node_count());
    s.prescribed[p.node] = 1;
    s.guess.segment<3>(3 * p.node) = p.velocity;
  }
  s.any_prescribed = !prescribed.empty();
}

}  // namespace

StepSystem::StepSystem(bool float_matrix) {
  if (float_matrix) A = BlockSparseMatrix<float>();
}

void StepSystem::multiply(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> y,
                          const ThreadPool& pool) const {
  std::visit([&](const auto& matrix) { matrix.multiply(x, y, pool); }, A);
}

const std::vector<Mat3>& StepSystem::diagonal() const {
  return std::visit([](const auto& matrix) -> const std::vector<Mat3>& { return matrix.diagonal(); }, A);
}

Eigen::SparseMatrix<double> StepSystem::to_sparse() const {
  return std::visit([](const auto& matrix) { return matrix.to_sparse(); }, A);
}

StepFormula backward_euler_formula(const FemState& state, double dt) {
  return {.dt = dt, .w = state.v, .x_known = state.x, .x_linear = state.x};
}

void assemble(const RestBody& rest, const std::vector<Tet>& tets, const FemState& state,
              Eigen::Ref<const Eigen::VectorXd> f_ext, double dt, std::span<const PrescribedNode> prescribed,
              const ThreadPool& pool, StepSystem& system) {
  assemble(rest, tets, state, backward_euler_formula(state, dt), f_ext, prescribed, pool, system);
}

void assemble(const RestBody& rest, const std::vector<Tet>& tets, const FemState& state, const StepFormula& formula,
              Eigen::Ref<const Eigen::VectorXd> f_ext, std::span<const PrescribedNode> prescribed,
              const ThreadPool& pool, StepSystem& system) {
  const int n = static_cast<int>(state.x.size());
  const double dt = formula.dt;
  assert(dt > 0 && f_ext.size() == 3 * n && static_cast<int>(state.v.size()) == n && rest.node_count() == n);
  assert(formula.w.size() == state.x.size() && formula.x_known.size() == state.x.size());
  if (system.node_count() != n || system.connectivity.tets != tets) rebuild(n, tets, system);
  set_prescribed(state, prescribed, system);
  update_elements(rest, tets, formula.x_linear, state.plastic_strain, pool, system.elements);
  if (&formula.x_known != &formula.x_linear) shift_forces(rest, tets, formula, pool, system.elements);

  const Factors factors = factors_of(rest.material, formula);
  if (rest.heterogeneous()) set_weights(rest, formula, system);
  std::visit(
      [&](auto& A) {
        const auto edges = [&](int begin, int end) { assemble_edges(rest, factors, system, A, begin, end); };
        pool.for_chunks(system.connectivity.edge_count(), kEdgesPerChunk, std::cref(edges));

        const auto nodes = [&](int begin, int end) {
          for (int i = begin; i < end; ++i) {
            const double m = rest.node_mass[i];
            system.row_mass[i] = rest.heterogeneous() ? formula.mass * m + dt * rest.node_drag[i] : factors.mass * m;
            A.diagonal()[i] = row_diagonal(A, system.row_mass[i], i);
            system.b.segment<3>(3 * i) = dt * (f_ext.segment<3>(3 * i) + gather_force(system, i)) + m * formula.w[i];
            if (system.any_prescribed) strike(system, A, i);
          }
        };
        pool.for_chunks(n, kNodesPerChunk, std::cref(nodes));
      },
      system.A);
}

void remove_net_momentum_error(const StepSystem& system, Eigen::Ref<Eigen::VectorXd> v) {
  if (system.any_prescribed) return;
  Vec3 error = Vec3::Zero();
  double mass = 0;
  for (int i = 0; i < system.node_count(); ++i) {
    error += system.b.segment<3>(3 * i) - system.row_mass[i] * v.segment<3>(3 * i);
    mass += system.row_mass[i];
  }
  const Vec3 correction = error / mass;
  for (int i = 0; i < system.node_count(); ++i) v.segment<3>(3 * i) += correction;
}

}  // namespace crumple::sim::fem
