#include "server/sim/fem/element_quad.h"

#include "server/sim/fem/quad_law.h"

namespace crumple::sim::fem {
namespace {

// D_x of four tets.
QuadMatrix edge_matrices(const std::vector<Tet>& tets, int t, std::span<const Vec3> x) {
  Quad corner[4][3];
  for (int a = 0; a < 4; ++a)
    load_vectors(x[tets[t][a]].data(), x[tets[t + 1][a]].data(), x[tets[t + 2][a]].data(), x[tets[t + 3][a]].data(), corner[a]);
  QuadMatrix D;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) D(i, k) = corner[k + 1][i] - corner[0][i];
  return D;
}

// Columns 1 to 3 of four 3x4 matrices, and minus their sum before them: normals of a closed surface sum to zero, and so,
// exactly, do these.
void store_corners(const QuadMatrix& a, Mat34* to) {
  Quad all[12];
  for (int i = 0; i < 3; ++i) all[i] = -(a(i, 0) + a(i, 1) + a(i, 2));
  for (int k = 0; k < 9; ++k) all[3 + k] = a.m[k];
  store_rows<12>(all, to->data());
}

}  // namespace

int inverted_of_four(const std::vector<Tet>& tets, int t, std::span<const Vec3> x) {
  const QuadMatrix D = edge_matrices(tets, t, x);
  const Quad d = first_column_dot(cofactors(D), D);
  return (d[0] < 0) + (d[1] < 0) + (d[2] < 0) + (d[3] < 0);
}

bool update_element_quad(const RestBody& rest, const std::vector<Tet>& tets, int t, std::span<const Vec3> x,
                         const std::vector<Mat3>& plastic_strain, Elements& e, double& energy) {
  if (!rest.beta_clamped.empty()) return false;
  const QuadMatrix beta = load(&rest.beta[t]);
  const QuadMatrix F = product(edge_matrices(tets, t, x), beta);
  QuadLaw law;
  law.set_materials(rest, [&](int lane) { return t + lane; });
  if (!law.update(F, load(four_plastic_strains(plastic_strain, t)))) return false;
  // c_i = -sqrt(fill V) beta^T e_i, f_i = fill Q sigma n_i / 3 = sqrt(fill V) Q sigma c_i
  const Quad scale = load_four(&rest.fill[t]) * load_four(&rest.volume[t]), root = square_root(scale);
  QuadMatrix turn = law.Q, P = product(law.Q, law.stress);
  for (Quad& q : turn.m) q *= -root;
  for (Quad& p : P.m) p *= -scale;
  energy += sum_of_lanes(scale * law.energy_density())[0];
  store(law.Q, &e.Q[t]);
  store(law.sigma, &e.sigma[t]);
  store_corners(product_transposed(turn, beta), &e.core[t]);
  store_corners(product_transposed(P, beta), &e.force[t]);
  return true;
}

}  // namespace crumple::sim::fem
