#include "server/sim/fem/patch_elements.h"

#include "server/sim/fem/mean_gradient.h"
#include "server/sim/fem/macro_states.h"
#include "server/sim/fem/rotation.h"

#include <cassert>
#include <cmath>
#include <functional>

namespace crumple::sim::fem {
namespace {

constexpr int kPerChunk = 64;

double plastic_trace(const RestBody& rest, int p, const std::vector<Mat3>& plastic_strain) {
  const PressurePatches& patches = rest.patches;
  double sum = 0;
  for (int k = patches.tet_start[p]; k < patches.tet_start[p + 1]; ++k) {
    const int t = patches.tets[k];
    sum += rest.fill[t] * rest.volume[t] * tet_plastic_strain(rest, plastic_strain, t).trace();
  }
  return sum / patches.volume[p];
}

}  // namespace

void update_patches(const RestBody& rest, const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain, const ThreadPool& pool,
                    PatchElements& e, std::span<Vec3> core, std::span<Vec3> force) {
  const PressurePatches& patches = rest.patches;
  assert(core.size() == patches.nodes.size() && force.size() == core.size());
  e.Q.resize(patches.count());
  e.pressure.resize(patches.count());
  const auto body = [&](int first, int last) {
    for (int p = first; p < last; ++p) {
      const Mat3 F = mean_gradient(patches, p, x), Q = rotation(F, rest.material_of(patches.first_tet(p)).rotation);
      const double theta = (Q.transpose() * F).trace() - 3 - plastic_trace(rest, p, plastic_strain);
      const double pressure = rest.lambda_of_patch(p) * theta, to_force = std::sqrt(patches.volume[p]) * pressure;
      e.Q[p] = Q;
      e.pressure[p] = pressure;
      const int begin = patches.corner_start[p], end = patches.corner_start[p + 1];
      core[begin] = force[begin] = Vec3::Zero();
      for (int c = begin + 1; c < end; ++c) {
        core[c] = Q * patches.core[c];
        force[c] = to_force * core[c];
        core[begin] -= core[c];
        force[begin] -= force[c];
      }
    }
  };
  pool.for_chunks(patches.count(), kPerChunk, std::cref(body));
}

double patch_energy(const RestBody& rest, const PatchElements& e) {
  double energy = 0;
  for (int p = 0; p < rest.patches.count(); ++p) energy += rest.patches.volume[p] * e.pressure[p] * e.pressure[p] / (2 * rest.lambda_of_patch(p));
  return energy;
}

double patch_pressure(const RestBody& rest, const PatchElements& e, int t) {
  if (rest.patches.empty() || rest.patches.of_tet[t] < 0) return 0;
  return e.pressure[rest.patches.of_tet[t]];
}

void add_patch_stiffness(const RestBody& rest, const std::vector<Vec3>& x, const PatchElements& e, std::span<const Vec3> core,
                         bool exact, std::vector<Eigen::Triplet<double>>& entries) {
  const PressurePatches& patches = rest.patches;
  for (int p = 0; p < patches.count(); ++p) {
    const Lame lame{rest.lambda_of_patch(p), 0};
    Mat9 A;
    if (exact) {
      const Mat3 F = mean_gradient(patches, p, x);
      // The trace that leaves it this pressure.
      const double plastic = (e.Q[p].transpose() * F).trace() - 3 - e.pressure[p] / lame.lambda;
      A = first_piola_derivative(lame, e.Q[p], F, plastic / 3 * Mat3::Identity());
    }
    for (int a = patches.corner_start[p]; a < patches.corner_start[p + 1]; ++a)
      for (int b = patches.corner_start[p]; b < patches.corner_start[p + 1]; ++b) {
        Mat3 block = lame.lambda * core[a] * core[b].transpose();
        if (exact) {
          block.setZero();
          for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l) block += patches.core[a][k] * patches.core[b][l] * A.block<3, 3>(3 * k, 3 * l);
        }
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) entries.emplace_back(3 * patches.nodes[a] + i, 3 * patches.nodes[b] + j, block(i, j));
      }
  }
}

}  // namespace crumple::sim::fem
