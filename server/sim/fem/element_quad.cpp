#include "server/sim/fem/element_quad.h"

#include "server/sim/fem/quad_law.h"

namespace crumple::sim::fem {
namespace {

// D_x beta of four tets.
QuadMatrix deformation_gradients(const std::vector<Tet>& tets, int t, std::span<const Vec3> x, const QuadMatrix& beta) {
  QuadMatrix D;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) {
      Quad& d = D(i, k);
      for (int lane = 0; lane < 4; ++lane) d[lane] = x[tets[t + lane][k + 1]][i] - x[tets[t + lane][0]][i];
    }
  return product(D, beta);
}

}  // namespace

bool update_element_quad(const RestBody& rest, const std::vector<Tet>& tets, int t, std::span<const Vec3> x,
                         const std::vector<Mat3>& plastic_strain, Elements& e) {
  if (!rest.beta_clamped.empty()) return false;
  const QuadMatrix F = deformation_gradients(tets, t, x, load(rest.beta, t));
  QuadLaw law;
  Quad scale;
  for (int lane = 0; lane < 4; ++lane) {
    law.set_material(lane, rest.material_of(t + lane), rest.lame_of(t + lane), plastic_strain[t + lane]);
    scale[lane] = rest.fill[t + lane] * rest.volume[t + lane];
  }
  if (!law.update(F, load(plastic_strain, t))) return false;
  // f_i = fill Q sigma n_i / 3 = sqrt(fill V) Q sigma c_i
  QuadMatrix c;
  for (int lane = 0; lane < 4; ++lane)
    for (int k = 0; k < 9; ++k) c.m[k][lane] = rest.core[t + lane].data()[3 + k];
  QuadMatrix P = product(law.Q, law.stress);
  for (Quad& p : P.m) p *= square_root(scale);
  const QuadMatrix core = product(law.Q, c), force = product(P, c);
  for (int lane = 0; lane < 4; ++lane) {
    store(law.Q, lane, e.Q[t + lane].data());
    store(law.sigma, lane, e.sigma[t + lane].data());
    store(core, lane, e.core[t + lane].data() + 3);
    store(force, lane, e.force[t + lane].data() + 3);
  }
  // Normals of a closed surface sum to zero; so, exactly, do these.
  for (int lane = 0; lane < 4; ++lane) {
    e.core[t + lane].col(0) = -e.core[t + lane].rightCols<3>().rowwise().sum();
    e.force[t + lane].col(0) = -e.force[t + lane].rightCols<3>().rowwise().sum();
  }
  return true;
}

}  // namespace crumple::sim::fem
