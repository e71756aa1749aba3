#include "server/sim/fem/macro_states.h"

#include "server/sim/fem/elements.h"
#include "server/sim/fem/hexahedron_states.h"
#include "server/sim/fem/mean_gradient.h"
#include "server/sim/fem/octahedron_quad.h"
#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/rotation.h"
#include "server/sim/fem/smoothed_octahedron.h"
#include "server/sim/fem/tensile_part.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>

namespace crumple::sim::fem {
namespace {

constexpr int kPerChunk = 128;

Vec3 hourglass(const MacroElements& o, int d, const std::vector<Vec3>& x) {
  const int begin = o.corner_start[d], end = o.corner_start[d + 1];
  const Vec3& from = x[o.nodes[begin]];
  Vec3 z = Vec3::Zero();
  for (int c = begin + 1; c < end; ++c) z += o.gamma[c] * (x[o.nodes[c]] - from);
  return z;
}

// An element of one tet is that tet, near inversion or not. Of closed octahedra z says enough of how tets deviate.
bool must_split(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x, const Mat3& F, const Vec3& z, int d) {
  const MacroElements& o = rest.macros;
  const bool closed = d < o.closed;
  if (closed && !(z.squaredNorm() <= kSplitSlide * o.volume[d] * rest.lame_of(o.first_tet(d)).mu)) return true;
  if (o.tet_start[d + 1] - o.tet_start[d] == 1) return rest.clamped(o.first_tet(d));
  for (int k = o.tet_start[d]; k < o.tet_start[d + 1]; ++k) {
    const int t = o.tets[k];
    const Mat3 F_t = deformation_gradient(gather(x, tets[t]), rest.beta[t]);
    if (!(F_t.determinant() >= kSplitVolume && (closed || (F_t - F).norm() <= kSplitDeviation))) return true;
  }
  return false;
}

void update_element(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                    const Mat3& plastic_strain, int d, MacroStates& e) {
  const MacroElements& o = rest.macros;
  const int t = o.first_tet(d), begin = o.corner_start[d], end = o.corner_start[d + 1];
  const FemMaterial& material = rest.material_of(t);
  const Mat3 F = mean_gradient(o, d, x), Q = rotation(F, material.rotation);
  const Mat3 sigma = isotropic_stress(rest.lame_of(t), corotational_strain(Q, F) - plastic_strain);
  Mat3 stress = sigma;
  if (balances_moment(material, plastic_strain)) stress += moment_balance(symmetric_part(Q.transpose() * F), sigma);
  const bool hexahedron = d < o.hexahedra;
  HexahedronForces bent;
  if (hexahedron) {
    e.Y[d] = local_corners(o, d, x, Q);
    bent = hexahedron_forces(o, d, e.Y[d], symmetric_part(Q.transpose() * F));
    stress += bent.stress;
  }
  const Vec3 z = hourglass(o, d, x);
  const bool split = must_split(rest, tets, x, F, z, d);
  if (hexahedron) e.tension[d] = split ? Mat3::Zero() : Mat3(Q * tensile_part(sigma) * Q.transpose());
  const Mat3 turn = split ? Mat3::Zero() : Q, P = std::sqrt(o.volume[d]) * (turn * stress);
  e.Q[d] = Q;
  e.sigma[d] = sigma;
  e.z[d] = z;
  e.split[d] = split;
  e.core[begin].setZero();
  e.force[begin].setZero();
  for (int c = begin + 1; c < end; ++c) {
    e.core[c] = turn * o.core[c];
    e.force[c] = P * o.core[c] - o.gamma[c] * z;
    if (hexahedron) e.force[c] -= turn * bent.corner[c - begin];
    e.core[begin] -= e.core[c];
    e.force[begin] -= e.force[c];
  }
}

// The tets of elements that are split, by what they give to those.
void update_split_tets(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                       const std::vector<Mat3>& plastic_strain, MacroStates& e) {
  const MacroElements& o = rest.macros;
  e.any_split = std::ranges::any_of(e.split, [](char split) { return split != 0; });
  const std::size_t corners = rest.corner_count();
  if (!e.any_split) {
    e.core.resize(corners);
    e.force.resize(corners);
    return;
  }
  e.core.resize(corners + 4 * tets.size());
  e.force.resize(corners + 4 * tets.size());
  std::fill(e.core.begin() + corners, e.core.end(), Vec3::Zero());
  std::fill(e.force.begin() + corners, e.force.end(), Vec3::Zero());
  e.tet_share.assign(tets.size(), 0.0);
  e.tet_Q.resize(tets.size());
  e.tet_sigma.resize(tets.size());
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const double share = 0.5 * (e.split[o.of_tet[2 * t]] + e.split[o.of_tet[2 * t + 1]]);
    if (share == 0) continue;
    const auto [Q, sigma, stress] = tet_law(rest, t, gather(x, tets[t]), tet_plastic_strain(rest, plastic_strain, t));
    const Mat3 P = share * std::sqrt(rest.fill[t] * rest.volume[t]) * (Q * stress);
    e.tet_share[t] = share;
    e.tet_Q[t] = Q;
    e.tet_sigma[t] = sigma;
    const Mat34 core = rest.core(t);
    for (int a = 0; a < 4; ++a) {
      e.core[corners + 4 * t + a] = std::sqrt(share) * (Q * core.col(a));
      e.force[corners + 4 * t + a] = P * core.col(a);
    }
  }
}

// Co-rotated strain of element d, plastic part included. Cores of a clamped tet, which stays alone, are of its clamped basis.
Mat3 strain_of(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x, int d) {
  const int t = rest.macros.first_tet(d);
  const RotationRule rule = rest.material_of(t).rotation;
  if (rest.clamped(t)) {
    const Mat34 x_t = gather(x, tets[t]);
    return element_strain(rest, t, x_t, rotation(deformation_gradient(x_t, rest.beta[t]), rule));
  }
  const Mat3 F = mean_gradient(rest.macros, d, x);
  return corotational_strain(rotation(F, rule), F);
}

void resize(const RestBody& rest, MacroStates& e) {
  const MacroElements& o = rest.macros;
  e.Q.resize(o.count());
  e.sigma.resize(o.count());
  e.z.resize(o.count());
  e.split.resize(o.count());
  e.Y.resize(o.hexahedra);
  e.tension.resize(o.hexahedra);
  if (e.core.size() < rest.corner_count()) {
    e.core.resize(rest.corner_count());
    e.force.resize(rest.corner_count());
  }
}

}  // namespace

void update_macros(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                   const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, MacroStates& e) {
  const MacroElements& o = rest.macros;
  assert(plastic_strain.empty() || static_cast<int>(plastic_strain.size()) == o.count());
  resize(rest, e);
  const auto body = [&](int begin, int end) {
    for (int d = begin; d < end;) {
      if (d + 4 <= std::min(end, o.closed) && update_octahedron_quad(rest, x, plastic_strain, d, e)) {
        d += 4;
        continue;
      }
      for (const int stop = std::min(d + 4, end); d < stop; ++d) update_element(rest, tets, x, plastic_strain_at(plastic_strain, d), d, e);
    }
  };
  pool.for_chunks(o.count(), kPerChunk, std::cref(body));
  const std::size_t first = o.nodes.size(), count = rest.patches.nodes.size();
  if (!rest.patches.empty())
    update_patches(rest, x, plastic_strain, pool, e.patches, std::span(e.core).subspan(first, count), std::span(e.force).subspan(first, count));
  update_split_tets(rest, tets, x, plastic_strain, e);
}

void flow_macros(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                 std::span<const double> creep, const ThreadPool& pool, std::vector<Mat3>& plastic_strain,
                 MacroStates& e) {
  const MacroElements& o = rest.macros;
  const auto body = [&](int begin, int end) {
    for (int d = begin; d < end; ++d) {
      const int t = o.first_tet(d);
      const FemMaterial& m = rest.material_of(t);
      flow(m.flow, strain_of(rest, tets, x, d), m.yield, creep[rest.heterogeneous() ? rest.material_id[t] : 0], m.max_plastic,
           plastic_strain[d]);
    }
  };
  pool.for_chunks(o.count(), kPerChunk, std::cref(body));
  update_macros(rest, tets, x, plastic_strain, pool, e);
}

Mat3 tet_stress(const RestBody& rest, const MacroStates& e, int t) {
  if (in_hexahedron(rest.macros, e, t)) return hexahedron_stress(rest, e, t);
  Mat3 sum = Mat3::Zero();
  for (int k = 0; k < 2; ++k) {
    const int d = rest.macros.of_tet[2 * t + k];
    const Mat3& Q = e.split[d] ? e.tet_Q[t] : e.Q[d];
    sum += 0.5 * Q * (e.split[d] ? e.tet_sigma[t] : e.sigma[d]) * Q.transpose();
  }
  return sum + patch_pressure(rest, e.patches, t) * Mat3::Identity();
}

Mat34 tet_normals(const RestBody& rest, const MacroStates& e, int t) {
  if (in_hexahedron(rest.macros, e, t)) return hexahedron_normals(rest, e, t);
  Mat3 mean = Mat3::Zero();
  for (int k = 0; k < 2; ++k) {
    const int d = rest.macros.of_tet[2 * t + k];
    mean += 0.5 * (e.split[d] ? e.tet_Q[t] : e.Q[d]);
  }
  return 3 * std::sqrt(rest.volume[t] * rest.fill[t]) * mean * rest.core(t);
}

Mat3 tet_plastic_strain(const RestBody& rest, const std::vector<Mat3>& plastic_strain, int t) {
  const auto at = [&](int slot) -> const Mat3& { return plastic_strain_at(plastic_strain, rest.macros.of_tet[slot]); };
  return 0.5 * (at(2 * t) + at(2 * t + 1));
}

double macro_energy(const RestBody& rest, const MacroStates& e) {
  const MacroElements& o = rest.macros;
  double energy = patch_energy(rest, e.patches);
  for (int d = 0; d < o.count(); ++d) {
    energy += 0.5 * e.z[d].squaredNorm();
    if (d < o.hexahedra && !e.split[d]) energy += hexahedron_energy(o, d, e.Y[d]);
    if (!e.split[d]) energy += o.volume[d] * energy_density_of_stress(rest.lame_of(o.first_tet(d)), e.sigma[d]);
  }
  for (int t = 0; e.any_split && t < rest.tet_count(); ++t) {
    if (e.tet_share[t] > 0) energy += e.tet_share[t] * rest.fill[t] * rest.volume[t] * energy_density_of_stress(rest.lame_of(t), e.tet_sigma[t]);
  }
  return energy;
}

void add_macro_forces(const RestBody& rest, const std::vector<Tet>& tets, const MacroStates& e,
                      Eigen::Ref<Eigen::VectorXd> f) {
  const Vec3* force = e.force.data();
  for (const std::vector<int>* nodes : {&rest.macros.nodes, &rest.patches.nodes})
    for (const int n : *nodes) f.segment<3>(3 * n) += *force++;
  for (std::size_t t = 0; e.any_split && t < tets.size(); ++t)
    for (const int n : tets[t]) f.segment<3>(3 * n) += *force++;
}

void add_macro_stiffness(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                         const std::vector<Mat3>& plastic_strain, bool exact, const MacroStates& e,
                         std::vector<Eigen::Triplet<double>>& entries) {
  const MacroElements& o = rest.macros;
  const auto add = [&](int i, int j, const Mat3& block) {
    for (int p = 0; p < 3; ++p)
      for (int q = 0; q < 3; ++q) entries.emplace_back(3 * i + p, 3 * j + q, block(p, q));
  };
  for (int d = 0; d < o.count(); ++d) {
    const Lame& lame = rest.lame_of(o.first_tet(d));
    Mat9 A;
    if (exact) A = first_piola_derivative(lame, e.Q[d], mean_gradient(o, d, x), plastic_strain_at(plastic_strain, d));
    const bool bends = d < o.hexahedra && !e.split[d];
    Eigen::Matrix<double, 24, 24> bent;
    if (bends && exact) bent = exact_hexahedron_stiffness(o, d, e.Y[d], e.Q[d], mean_gradient(o, d, x));
    for (int a = o.corner_start[d]; a < o.corner_start[d + 1]; ++a) {
      for (int b = o.corner_start[d]; b < o.corner_start[d + 1]; ++b) {
        Mat3 block = o.gamma[a] * o.gamma[b] * Mat3::Identity();
        if (!e.split[d] && exact) {
          for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l) block += o.core[a][k] * o.core[b][l] * A.block<3, 3>(3 * k, 3 * l);
        } else if (!e.split[d]) {
          const Vec3 c = e.core[a], g = e.core[b];
          block += lame.lambda * c * g.transpose() + lame.mu * c.dot(g) * Mat3::Identity() + lame.mu * g * c.transpose();
        }
        if (bends) {
          const int i = a - o.corner_start[d], j = b - o.corner_start[d];
          block += exact ? Mat3(bent.block<3, 3>(3 * i, 3 * j)) : Mat3(e.Q[d] * o.shape(d).H[8 * i + j] * e.Q[d].transpose());
        }
        add(o.nodes[a], o.nodes[b], block);
      }
    }
  }
  add_patch_stiffness(rest, x, e.patches, std::span(e.core).subspan(o.nodes.size(), rest.patches.nodes.size()), exact, entries);
  for (int t = 0; e.any_split && t < rest.tet_count(); ++t) {
    if (e.tet_share[t] == 0) continue;
    const RestTet tet = rest.tet(t);
    if (exact) {
      const Mat12 K = e.tet_share[t] * exact_stiffness(tet, rest.lame_of(t), gather(x, tets[t]), e.tet_Q[t],
                                                       tet_plastic_strain(rest, plastic_strain, t));
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) add(tets[t][a], tets[t][b], K.block<3, 3>(3 * a, 3 * b));
      continue;
    }
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        add(tets[t][a], tets[t][b], e.tet_share[t] * stiffness_block(tet, rest.lame_of(t), e.tet_Q[t], a, b));
  }
}

}  // namespace crumple::sim::fem
