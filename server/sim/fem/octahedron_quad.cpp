#include "server/sim/fem/octahedron_quad.h"

#include "server/sim/fem/quad_law.h"

namespace crumple::sim::fem {
namespace {

constexpr int kClosedCorners = 6;

Quad dot(const Quad (&a)[3], const Quad (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void cross(const Quad (&a)[3], const Quad (&b)[3], Quad (&c)[3]) {
  for (int i = 0; i < 3; ++i) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

}  // namespace

bool update_octahedron_quad(const RestBody& rest, const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain, int d,
                            OctahedronElements& e) {
  const SmoothedOctahedra& o = rest.octahedra;
  const int* nodes = &o.nodes[kClosedCorners * d];
  const double* cores = o.core[kClosedCorners * d].data();
  Quad r[kClosedCorners - 1][3], c[kClosedCorners - 1][3];  // corners from the first; their cores
  for (int lane = 0; lane < 4; ++lane) {
    const Vec3& from = x[nodes[kClosedCorners * lane]];
    for (int a = 1; a < kClosedCorners; ++a) {
      const Vec3& at = x[nodes[kClosedCorners * lane + a]];
      for (int i = 0; i < 3; ++i) {
        r[a - 1][i][lane] = at[i] - from[i];
        c[a - 1][i][lane] = cores[3 * (kClosedCorners * lane + a) + i];
      }
    }
  }
  for (int k = 0; k < 4; ++k) {
    Quad area[3], rest_volume;
    cross(r[1 + k], r[1 + (k + 1) % 4], area);
    for (int lane = 0; lane < 4; ++lane) rest_volume[lane] = rest.volume[o.tets[4 * (d + lane) + k]];
    if (any(~(dot(r[0], area) >= quad(6 * kSplitVolume) * rest_volume))) return false;
  }

  Quad volume, mu;
  QuadLaw law;
  for (int lane = 0; lane < 4; ++lane) {
    const int t = o.first_tet(d + lane);
    law.set_material(lane, rest.material_of(t), rest.lame_of(t), plastic_strain[d + lane]);
    volume[lane] = o.volume[d + lane];
    mu[lane] = rest.lame_of(t).mu;
  }
  Quad gamma[kClosedCorners - 1], z[3];
  for (int a = 0; a < kClosedCorners - 1; ++a)
    for (int lane = 0; lane < 4; ++lane) gamma[a][lane] = o.gamma[kClosedCorners * (d + lane) + a + 1];
  for (int i = 0; i < 3; ++i) {
    z[i] = gamma[0] * r[0][i];
    for (int a = 1; a < kClosedCorners - 1; ++a) z[i] += gamma[a] * r[a][i];
  }
  if (any(~(dot(z, z) <= quad(kSplitSlide) * volume * mu))) return false;
  const Quad root = square_root(volume), to_gradient = quad(-1) / root;
  QuadMatrix F;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      Quad sum = r[0][i] * c[0][j];
      for (int a = 1; a < kClosedCorners - 1; ++a) sum += r[a][i] * c[a][j];
      F(i, j) = to_gradient * sum;
    }
  if (!law.update(F, load(plastic_strain, d))) return false;
  QuadMatrix P = product(law.Q, law.stress);
  for (Quad& p : P.m) p *= root;

  Quad core_sum[3]{}, force_sum[3]{};
  double* core = e.core[kClosedCorners * d].data();
  double* force = e.force[kClosedCorners * d].data();
  for (int a = 0; a < kClosedCorners - 1; ++a) {
    for (int i = 0; i < 3; ++i) {
      const Quad turned = law.Q(i, 0) * c[a][0] + law.Q(i, 1) * c[a][1] + law.Q(i, 2) * c[a][2];
      const Quad f = P(i, 0) * c[a][0] + P(i, 1) * c[a][1] + P(i, 2) * c[a][2] - gamma[a] * z[i];
      core_sum[i] -= turned;
      force_sum[i] -= f;
      for (int lane = 0; lane < 4; ++lane) {
        core[3 * (kClosedCorners * lane + a + 1) + i] = turned[lane];
        force[3 * (kClosedCorners * lane + a + 1) + i] = f[lane];
      }
    }
  }
  for (int lane = 0; lane < 4; ++lane) {
    for (int i = 0; i < 3; ++i) {
      core[3 * kClosedCorners * lane + i] = core_sum[i][lane];
      force[3 * kClosedCorners * lane + i] = force_sum[i][lane];
      e.z[d + lane][i] = z[i][lane];
    }
    store(law.Q, lane, e.Q[d + lane].data());
    store(law.sigma, lane, e.sigma[d + lane].data());
    e.split[d + lane] = 0;
  }
  return true;
}

}  // namespace crumple::sim::fem
