#include "server/sim/fem/octahedron_quad.h"

#include "server/sim/fem/fem_state.h"
#include "server/sim/fem/quad_law.h"
#include "server/sim/fem/smoothed_octahedron.h"

namespace crumple::sim::fem {
namespace {

constexpr int kClosedCorners = 6;

Quad dot(const Quad (&a)[3], const Quad (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void cross(const Quad (&a)[3], const Quad (&b)[3], Quad (&c)[3]) {
  for (int i = 0; i < 3; ++i) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

}  // namespace

bool update_octahedron_quad(const RestBody& rest, const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain, int d,
                            MacroStates& e) {
  const MacroElements& o = rest.macros;
  const int* nodes = &o.nodes[kClosedCorners * d];
  const double* cores = o.core[kClosedCorners * d].data();
  Quad r[kClosedCorners - 1][3], c[kClosedCorners][3], first[3];  // corners from the first; cores of all
  const auto load_corner = [&](int a, Quad (&to)[3]) {
    load_vectors(x[nodes[a]].data(), x[nodes[kClosedCorners + a]].data(), x[nodes[2 * kClosedCorners + a]].data(),
                 x[nodes[3 * kClosedCorners + a]].data(), to);
  };
  load_corner(0, first);
  for (int a = 1; a < kClosedCorners; ++a) {
    load_corner(a, r[a - 1]);
    for (int i = 0; i < 3; ++i) r[a - 1][i] -= first[i];
  }
  constexpr int kNumbers = 3 * kClosedCorners;  // a lane's
  load_rows<kNumbers>(cores, &c[0][0]);
  for (int k = 0; k < 4; ++k) {
    Quad area[3], rest_volume;
    cross(r[1 + k], r[1 + (k + 1) % 4], area);
    for (int lane = 0; lane < 4; ++lane) rest_volume[lane] = rest.volume[o.tets[4 * (d + lane) + k]];
    if (!all(dot(r[0], area) >= quad(6 * kSplitVolume) * rest_volume)) return false;
  }

  QuadLaw law;
  law.set_materials(rest, [&](int lane) { return o.first_tet(d + lane); });
  const Quad volume = load_four(&o.volume[d]);
  Quad gamma[kClosedCorners - 1], z[3];
  for (int a = 0; a < kClosedCorners - 1; ++a)
    for (int lane = 0; lane < 4; ++lane) gamma[a][lane] = o.gamma[kClosedCorners * (d + lane) + a + 1];
  for (int i = 0; i < 3; ++i) {
    z[i] = gamma[0] * r[0][i];
    for (int a = 1; a < kClosedCorners - 1; ++a) z[i] += gamma[a] * r[a][i];
  }
  if (!all(dot(z, z) <= quad(kSplitSlide) * volume * law.mu())) return false;
  const Quad root = square_root(volume), to_gradient = quad(-1) / root;
  QuadMatrix F;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      Quad sum = r[0][i] * c[1][j];
      for (int a = 1; a < kClosedCorners - 1; ++a) sum = multiply_add(r[a][i], c[a + 1][j], sum);
      F(i, j) = to_gradient * sum;
    }
  if (!law.update(F, load(four_plastic_strains(plastic_strain, d)))) return false;
  QuadMatrix P = product(law.Q, law.stress);
  for (Quad& p : P.m) p *= root;

  Quad core[kClosedCorners][3], force[kClosedCorners][3];
  for (int i = 0; i < 3; ++i) core[0][i] = force[0][i] = Quad{};
  for (int a = 1; a < kClosedCorners; ++a)
    for (int i = 0; i < 3; ++i) {
      core[a][i] = multiply_add(law.Q(i, 2), c[a][2], multiply_add(law.Q(i, 1), c[a][1], law.Q(i, 0) * c[a][0]));
      force[a][i] = multiply_add(P(i, 2), c[a][2], multiply_add(P(i, 1), c[a][1], P(i, 0) * c[a][0])) - gamma[a - 1] * z[i];
      core[0][i] -= core[a][i];
      force[0][i] -= force[a][i];
    }
  store_rows<kNumbers>(&core[0][0], e.core[kClosedCorners * d].data());
  store_rows<kNumbers>(&force[0][0], e.force[kClosedCorners * d].data());
  store(law.Q, &e.Q[d]);
  store(law.sigma, &e.sigma[d]);
  for (int lane = 0; lane < 4; ++lane) {
    e.z[d + lane] = Vec3(z[0][lane], z[1][lane], z[2][lane]);
    e.split[d + lane] = 0;
  }
  return true;
}

}  // namespace crumple::sim::fem
