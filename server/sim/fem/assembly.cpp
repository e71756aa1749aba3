#include "server/sim/fem/assembly.h"

#include "server/sim/fem/hexahedron_states.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/quad.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <functional>
#include <numeric>

namespace crumple::sim::fem {

using linear_solver::BlockSparseMatrix;

namespace {

constexpr int kTetsPerChunk = 256;
constexpr int kEdgesPerChunk = 512;
constexpr int kNodesPerChunk = 256;

// Corners of the body's elements; of groups of tets with those of patches after them, and of all tets where some stand for themselves.
ElementNodes element_nodes(const RestBody& rest, const std::vector<Tet>& tets, bool with_split) {
  ElementNodes elements;
  if (rest.grouped()) {
    elements.start = rest.macros.corner_start;
    elements.nodes = rest.macros.nodes;
    const int first = elements.start.back();
    for (int p = 1; p <= rest.patches.count(); ++p) elements.start.push_back(first + rest.patches.corner_start[p]);
    elements.nodes.insert(elements.nodes.end(), rest.patches.nodes.begin(), rest.patches.nodes.end());
    if (!with_split) return elements;
  } else {
    elements.start = {0};
  }
  elements.start.reserve(elements.start.size() + tets.size());
  elements.nodes.reserve(elements.nodes.size() + 4 * tets.size());
  for (const Tet& tet : tets) {
    elements.nodes.insert(elements.nodes.end(), tet.begin(), tet.end());
    elements.start.push_back(static_cast<int>(elements.nodes.size()));
  }
  return elements;
}

// Of each corner in the order of element_nodes.
void find_weights(const RestBody& rest, const ElementNodes& elements, StepSystem& s) {
  s.corner_weights.clear();
  if (!rest.heterogeneous() && rest.patches.empty()) return;
  int done = 0;
  const auto give_next = [&](int t, int first) {
    const int weights = first + (rest.heterogeneous() ? rest.material_id[t] : 0);
    s.corner_weights.resize(elements.start[++done], static_cast<std::uint16_t>(weights));
  };
  for (int d = 0; d < rest.macros.count(); ++d) give_next(rest.macros.first_tet(d), 0);
  for (int p = 0; p < rest.patches.count(); ++p) give_next(rest.patches.first_tet(p), rest.material_count());
  for (int t = 0; done + 1 < static_cast<int>(elements.start.size()); ++t) give_next(t, 0);
}

void connect(const RestBody& rest, const std::vector<Tet>& tets, int node_count, StepSystem& s) {
  const ElementNodes elements = element_nodes(rest, tets, s.with_split);
  s.connectivity = make_connectivity(node_count, elements);
  find_weights(rest, elements, s);
}

void find_pieces(int node_count, StepSystem& s) {
  std::vector<int> parent(node_count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& [i, j] : s.connectivity.edges) unite(parent, i, j);
  s.piece.resize(node_count);
  s.piece_count = 0;
  for (int i = 0; i < node_count; ++i) {  // a root is the lowest node of its piece
    const int root = find_root(parent, i);
    s.piece[i] = root == i ? s.piece_count++ : s.piece[root];
  }
  std::vector<int> size(s.piece_count, 0);
  for (const int piece : s.piece) ++size[piece];
  s.largest_piece = size.empty() ? 0 : std::ranges::max(size);
}

void rebuild(const RestBody& rest, const std::vector<Tet>& tets, int node_count, StepSystem& s) {
  s.tets = tets;
  s.with_split = false;
  s.spectral_bound = 4;
  for (int p = 0; p < rest.patches.count(); ++p)
    s.spectral_bound = std::max<double>(s.spectral_bound, rest.patches.corner_start[p + 1] - rest.patches.corner_start[p]);
  for (const HexahedronShape& shape : rest.macros.cells.shapes) s.spectral_bound = std::max(s.spectral_bound, shape.spectral_bound);
  connect(rest, tets, node_count, s);
  find_pieces(node_count, s);
  std::visit(
      [&]<class Scalar>(BlockSparseMatrix<Scalar>& A) {
        A = BlockSparseMatrix<Scalar>::from_edges(node_count, s.connectivity.edges, &s.edge_blocks);
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

Mat3 core_stress(const Lame& lame, const Mat3& D) {
  return lame.lambda * D.trace() * Mat3::Identity() + lame.mu * (D + D.transpose());
}

// As shift_forces, of what patches have of lambda.
void shift_patches(const RestBody& rest, const StepFormula& formula, const ThreadPool& pool, MacroStates& e) {
  const PressurePatches& patches = rest.patches;
  const std::size_t first = rest.macros.nodes.size();
  const auto shift = [&](int begin, int end) {
    for (int p = begin; p < end; ++p) {
      double trace = 0;
      for (int c = patches.corner_start[p]; c < patches.corner_start[p + 1]; ++c)
        trace += (formula.x_known[patches.nodes[c]] - formula.x_linear[patches.nodes[c]]).dot(e.core[first + c]);
      const double pressure = rest.lambda_of_patch(p) * trace;
      for (int c = patches.corner_start[p]; c < patches.corner_start[p + 1]; ++c) e.force[first + c] -= pressure * e.core[first + c];
    }
  };
  pool.for_chunks(patches.count(), kTetsPerChunk, std::cref(shift));
}

// Forces at x_linear become f(x_linear) - K (x_known - x_linear). With D = sum d_j c_j^T over displacements d_j eq. 2's
// product is K d = (lambda tr(D) I + mu (D + D^T)) c_i.
void shift_forces(const RestBody& rest, const std::vector<Tet>& tets, const StepFormula& formula,
                  const ThreadPool& pool, Elements& e) {
  const auto shift = [&](int begin, int end) {
    for (int t = begin; t < end; ++t) {
      const Mat34 d = gather(formula.x_known, tets[t]) - gather(formula.x_linear, tets[t]);
      const Mat3 D = edge_matrix(d) * e.core[t].rightCols<3>().transpose();
      e.force[t].rightCols<3>() -= core_stress(rest.lame_of(t), D) * e.core[t].rightCols<3>();
      e.force[t].col(0) = -e.force[t].rightCols<3>().rowwise().sum();
    }
  };
  if (!rest.grouped()) return pool.for_chunks(rest.tet_count(), kTetsPerChunk, std::cref(shift));

  const MacroElements& o = rest.macros;
  MacroStates& elements = e.macros;
  const auto displacement = [&](int node) { return Vec3(formula.x_known[node] - formula.x_linear[node]); };
  const auto shift_hexahedron = [&](int k) {  // what the mean does not see
    Mat38 Y;
    for (int a = 0; a < 8; ++a) Y.col(a) = elements.Q[k].transpose() * displacement(o.nodes[8 * k + a]);
    const std::array<Vec3, 8> f = o.shape(k).forces(Y);
    Mat3 stretched = Mat3::Zero();  // of tension, as a stress on the corners
    for (int a = 0; a < 8; ++a) stretched += displacement(o.nodes[8 * k + a]) * elements.core[8 * k + a].transpose();
    stretched = (stretched * elements.tension[k]).eval();
    for (int a = 0; a < 8; ++a) elements.force[8 * k + a] -= elements.Q[k] * f[a] + stretched * elements.core[8 * k + a];
  };
  const auto shift_groups = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      Mat3 D = Mat3::Zero();
      Vec3 z = Vec3::Zero();
      for (int c = o.corner_start[k]; c < o.corner_start[k + 1]; ++c) {
        const Vec3 d = displacement(o.nodes[c]);
        D += d * elements.core[c].transpose();
        z += o.gamma[c] * d;
      }
      const Mat3 stress = core_stress(rest.lame_of(o.first_tet(k)), D);
      for (int c = o.corner_start[k]; c < o.corner_start[k + 1]; ++c)
        elements.force[c] -= stress * elements.core[c] + o.gamma[c] * z;
      if (k < o.hexahedra && !elements.split[k]) shift_hexahedron(k);
    }
  };
  pool.for_chunks(o.count(), kTetsPerChunk, std::cref(shift_groups));
  shift_patches(rest, formula, pool, elements);
  for (int t = 0; elements.any_split && t < rest.tet_count(); ++t) {
    if (elements.tet_share[t] == 0) continue;
    const std::size_t corner = rest.corner_count() + 4 * t;
    Mat3 D = Mat3::Zero();
    for (int a = 0; a < 4; ++a) D += displacement(tets[t][a]) * elements.core[corner + a].transpose();
    const Mat3 stress = core_stress(rest.lame_of(t), D);
    for (int a = 0; a < 4; ++a) elements.force[corner + a] -= stress * elements.core[corner + a];
  }
}

// sum gamma_a gamma_b over the octahedra of an edge: its hourglass stiffness.
double edge_hourglass(const MacroElements& o, int a, int b) {
  return a < static_cast<int>(o.gamma.size()) ? o.gamma[a] * o.gamma[b] : 0;
}

// Off-diagonal block of an edge from its elements, times the formula's factor. With G = sum c_a c_b^T eq. 2's sum is
// lambda G + mu tr(G) I + mu G^T: here, by columns, G times lambda, G times mu, and the octahedra's hourglass stiffness. That of
// hexahedra is in what is times lambda: as that, it goes in untransposed.
struct EdgeSum {
  Quad of_lambda[3], of_mu[3];  // fourth lanes: 0
  double hourglass;
};

// The hexahedra's share of an edge, with the factor of each: it goes in as it is, where G's part of lambda does. Tension damps nothing:
// its part is theta dt^2 alone.
template <class FactorOf>
void add_hexahedra(const StepSystem& s, const RestBody& rest, int edge, const FactorOf& factor_of, EdgeSum& sum) {
  const double of_tension = s.scale.position * s.scale.dt * s.scale.dt;
  for (int k = s.connectivity.edge_start[edge]; k < s.connectivity.edge_start[edge + 1]; ++k) {
    const std::uint32_t pair = s.connectivity.edge_corners[k];
    const int first = Connectivity::first(pair);
    if (!of_hexahedron(rest.macros, first)) continue;
    const int second = Connectivity::second(pair);
    add_hexahedron_block(rest.macros, s.elements.macros, first, second, factor_of(first), sum.of_lambda);
    sum.hourglass += of_tension * tension_stiffness(s.elements.macros, first, second);
  }
}

[[gnu::always_inline]] inline EdgeSum edge_sum(const StepSystem& s, const RestBody& rest, const Factors& factors, int edge) {
  Quad G[3]{};
  double hourglass = 0;
  const double* cores = s.elements.cores();
  const bool grouped = rest.grouped();
  for (int k = s.connectivity.edge_start[edge]; k < s.connectivity.edge_start[edge + 1]; ++k) {
    const std::uint32_t pair = s.connectivity.edge_corners[k];
    const int first = Connectivity::first(pair), second = Connectivity::second(pair);
    const Quad a = load_three(cores + 3 * first);
    const double* b = cores + 3 * second;
    for (int j = 0; j < 3; ++j) G[j] = multiply_add(a, quad(b[j]), G[j]);
    if (grouped) hourglass += edge_hourglass(rest.macros, first, second);
  }
  const Quad lambda = quad(factors.stiffness * rest.lame.lambda), mu = quad(factors.stiffness * rest.lame.mu);
  EdgeSum sum{{lambda * G[0], lambda * G[1], lambda * G[2]}, {mu * G[0], mu * G[1], mu * G[2]}, factors.stiffness * hourglass};
  if (grouped && rest.macros.hexahedra > 0) add_hexahedra(s, rest, edge, [&](int) { return factors.stiffness; }, sum);
  return sum;
}

// The same where elements are of several materials or have patches: each with the weights of its own.
EdgeSum weighted_edge_sum(const StepSystem& s, const RestBody& rest, int edge) {
  EdgeSum sum{};
  const double* cores = s.elements.cores();
  const bool grouped = rest.grouped();
  for (int k = s.connectivity.edge_start[edge]; k < s.connectivity.edge_start[edge + 1]; ++k) {
    const std::uint32_t pair = s.connectivity.edge_corners[k];
    const int first = Connectivity::first(pair), second = Connectivity::second(pair);
    const StepSystem::Weights& weight = s.weights[s.corner_weights[first]];
    const Quad a = load_three(cores + 3 * first);
    const double* b = cores + 3 * second;
    for (int j = 0; j < 3; ++j) {
      sum.of_lambda[j] = multiply_add(a, quad(weight.lame.lambda * b[j]), sum.of_lambda[j]);
      sum.of_mu[j] = multiply_add(a, quad(weight.lame.mu * b[j]), sum.of_mu[j]);
    }
    if (grouped) sum.hourglass += weight.stiffness * edge_hourglass(rest.macros, first, second);
  }
  if (grouped && rest.macros.hexahedra > 0)
    add_hexahedra(s, rest, edge, [&](int corner) { return s.weights[s.corner_weights[corner]].stiffness; }, sum);
  return sum;
}

// Adds the trace and `more` to the diagonal.
[[gnu::always_inline]] inline void add_to_diagonal(const Quad (&of_trace)[3], double more, Quad (&to)[3]) {
  const Quad trace = sum_of_lanes(Quad{of_trace[0][0], of_trace[1][1], of_trace[2][2], more});
  to[0] += Quad{1, 0, 0, 0} * trace;
  to[1] += Quad{0, 1, 0, 0} * trace;
  to[2] += Quad{0, 0, 1, 0} * trace;
}

void set_weights(const RestBody& rest, const StepFormula& formula, StepSystem& s) {
  const int count = rest.material_count();
  s.weights.resize(2 * count);
  for (int k = 0; k < count; ++k) {
    const Lame& lame = k == 0 ? rest.lame : rest.others[k - 1].lame;
    const double stiffness = factors_of(rest.material_at(k), formula).stiffness;
    s.weights[k] = {{stiffness * lame.lambda, stiffness * lame.mu}, stiffness};
    s.weights[count + k] = {{stiffness * rest.patch_lambda(k), 0}, stiffness};
  }
}

template <class Scalar>
void assemble_edges(const RestBody& rest, const Factors& factors, StepSystem& s, BlockSparseMatrix<Scalar>& A,
                    int begin, int end) {
  const bool weighted = !s.corner_weights.empty();
  for (int edge = begin; edge < end; ++edge) {
    const EdgeSum sum = weighted ? weighted_edge_sum(s, rest, edge) : edge_sum(s, rest, factors, edge);
    // B = of_lambda + of_mu^T + ..., B^T = of_lambda^T + of_mu + ...
    Quad block[3] = {sum.of_mu[0], sum.of_mu[1], sum.of_mu[2]}, none{};
    transpose(block[0], block[1], block[2], none);
    for (int j = 0; j < 3; ++j) block[j] += sum.of_lambda[j];
    add_to_diagonal(sum.of_mu, sum.hourglass, block);
    A.set_block(s.edge_blocks[edge][0], block);
    transpose(block[0], block[1], block[2], none);
    A.set_block(s.edge_blocks[edge][1], block);
  }
}

Vec3 gather_force(const StepSystem& s, int node) {
  Quad f{};
  const double* forces = s.elements.forces();
  for (int k = s.connectivity.node_start[node]; k < s.connectivity.node_start[node + 1]; ++k)
    f += load_three(forces + 3 * s.connectivity.node_corners[k]);
  return {f[0], f[1], f[2]};
}

// Diagonal block of a row: the stiffness of a row sums to zero, since a translation strains nothing. Summed from the
// blocks as stored, so that it stays zero in float as well.
template <class Scalar>
Mat3 row_diagonal(const BlockSparseMatrix<Scalar>& A, double row_mass, int row) {
  Quad sum[3] = {Quad{}, Quad{}, Quad{}};
  for (int k = A.row_start()[row]; k < A.row_start()[row + 1]; ++k) {
    sum[0] -= load_four(A.values() + 9 * k);
    sum[1] -= load_four(A.values() + 9 * k + 3);
    sum[2] -= load_three(A.values() + 9 * k + 6);  // beyond are other rows, which other threads may be striking
  }
  return symmetric_part(to_matrix(sum)) + row_mass * Mat3::Identity();
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

bool differ(const std::vector<Tet>& a, const std::vector<Tet>& b, const ThreadPool& pool) {
  constexpr int kTetsPerLook = 4096;
  const auto chunk = [&](int begin, int end) { return std::memcmp(&a[begin], &b[begin], (end - begin) * sizeof(Tet)) != 0; };
  return a.size() != b.size() || pool.any_chunk(static_cast<int>(a.size()), kTetsPerLook, std::cref(chunk));
}

}  // namespace

StepSystem::StepSystem(bool float_matrix) {
  if (float_matrix) A = BlockSparseMatrix<float>();
}

void StepSystem::multiply(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> y,
                          const ThreadPool& pool) const {
  std::visit([&](const auto& matrix) { matrix.multiply(x, y, pool); }, A);
}

void StepSystem::multiply_rows(int begin, int end, const double* x, double* y) const {
  std::visit([&](const auto& matrix) { matrix.multiply_rows(begin, end, x, y); }, A);
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
  if (system.node_count() != n || differ(system.tets, tets, pool)) rebuild(rest, tets, n, system);
  set_prescribed(state, prescribed, system);
  system.scale = {dt, formula.mass, formula.position};
  update_elements(rest, tets, formula.x_linear, state.plastic_strain, pool, system.elements);
  if (&formula.x_known != &formula.x_linear) shift_forces(rest, tets, formula, pool, system.elements);

  if (system.with_split != system.elements.macros.any_split) {
    system.with_split = system.elements.macros.any_split;
    connect(rest, tets, n, system);  // the same edges: a group has all of its tets'
  }
  const Factors factors = factors_of(rest.material, formula);
  if (!system.corner_weights.empty()) set_weights(rest, formula, system);
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
