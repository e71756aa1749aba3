#include "server/sim/fem/elements.h"

#include "server/sim/fem/element_quad.h"
#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/rotation.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>

namespace crumple::sim::fem {

namespace {

constexpr int kTetsPerChunk = Elements::kTetsPerChunk;

bool is_inverted(const Mat34& x) { return edge_matrix(x).determinant() < 0; }

// Returns the tet's elastic energy [J].
double update_element(const RestBody& rest, int t, const Mat34& x, const Mat3& plastic_strain, Elements& e) {
  const auto [Q, sigma, stress] = tet_law(rest, t, x, plastic_strain);
  // f_i = fill Q sigma n_i / 3 = sqrt(fill V) Q sigma c_i
  const Mat3 P = std::sqrt(rest.fill[t] * rest.volume[t]) * (Q * stress);
  e.Q[t] = Q;
  e.sigma[t] = sigma;
  const Mat34 core = rest.core(t);
  e.core[t].rightCols<3>() = Q * core.rightCols<3>();
  e.force[t].rightCols<3>() = P * core.rightCols<3>();
  // Normals of a closed surface sum to zero; so, exactly, do these.
  e.core[t].col(0) = -e.core[t].rightCols<3>().rowwise().sum();
  e.force[t].col(0) = -e.force[t].rightCols<3>().rowwise().sum();
  return rest.fill[t] * rest.volume[t] * energy_density_of_stress(rest.lame_of(t), sigma);
}

void add_tet_stiffness(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                       const std::vector<Mat3>& plastic_strain, Tangent tangent, std::vector<Eigen::Triplet<double>>& entries) {
  for (int t = 0; t < rest.tet_count(); ++t) {
    const RestTet tet = rest.tet(t);
    const Mat34 x_t = gather(x, tets[t]);
    const Lame& lame = rest.lame_of(t);
    const Mat3 Q = rotation(deformation_gradient(x_t, tet.beta), rest.material_of(t).rotation);
    Mat12 K;
    if (tangent == Tangent::exact) {
      K = exact_stiffness(tet, lame, x_t, Q, plastic_strain_at(plastic_strain, t));
    } else {
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) K.block<3, 3>(3 * a, 3 * b) = stiffness_block(tet, lame, Q, a, b);
    }
    for (int p = 0; p < 12; ++p)
      for (int q = 0; q < 12; ++q)
        entries.emplace_back(3 * tets[t][p / 3] + p % 3, 3 * tets[t][q / 3] + q % 3, K(p, q));
  }
}

}  // namespace

TetLaw tet_law(const RestBody& rest, int t, const Mat34& x, const Mat3& plastic_strain) {
  const FemMaterial& material = rest.material_of(t);
  const Mat3 F = deformation_gradient(x, rest.beta[t]);
  TetLaw law{.Q = rotation(F, material.rotation)};
  law.stress = law.sigma = isotropic_stress(rest.lame_of(t), element_strain(rest, t, x, law.Q) - plastic_strain);
  // Forces of a clamped tet have a moment without plastic strain as well.
  if (balances_moment(material, plastic_strain) && !rest.clamped(t))
    law.stress += moment_balance(symmetric_part(law.Q.transpose() * F), law.sigma);
  return law;
}

bool Elements::is_of(const RestBody& rest) const {
  return static_cast<int>((rest.grouped() ? macros.sigma : sigma).size()) == rest.point_count();
}

const double* Elements::forces() const {
  return macros.force.empty() ? force.data()->data() : macros.force.data()->data();
}

const double* Elements::cores() const {
  return macros.core.empty() ? core.data()->data() : macros.core.data()->data();
}

Mat3 element_stress(const RestBody& rest, const Elements& elements, int t) {
  if (rest.grouped()) return tet_stress(rest, elements.macros, t);
  return elements.Q[t] * elements.sigma[t] * elements.Q[t].transpose();
}

Mat34 element_normals(const RestBody& rest, const Elements& elements, int t) {
  if (rest.grouped()) return tet_normals(rest, elements.macros, t);
  return 3 * std::sqrt(rest.volume[t] * rest.fill[t]) * elements.core[t];  // undoes the core's factor
}

Mat3 element_plastic_strain(const RestBody& rest, const std::vector<Mat3>& plastic_strain, int t) {
  return rest.grouped() ? tet_plastic_strain(rest, plastic_strain, t) : plastic_strain_at(plastic_strain, t);
}

void Elements::resize(int tet_count) {
  Q.resize(tet_count);
  sigma.resize(tet_count);
  force.resize(tet_count);
  core.resize(tet_count);
  chunk_energy.resize((tet_count + kTetsPerChunk - 1) / kTetsPerChunk);
  chunk_inverted.resize(chunk_energy.size());
}

Mat3 element_strain(const RestBody& rest, int t, const Mat34& x, const Mat3& Q) {
  if (rest.beta_clamped.empty()) return corotational_strain(Q, deformation_gradient(x, rest.beta[t]));
  return symmetric_part(Q.transpose() * deformation_gradient(x, rest.beta_clamped[t]) - rest.rest_gradient[t]);
}

void update_elements(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                     const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, Elements& elements) {
  assert(static_cast<int>(tets.size()) == rest.tet_count());
  assert(plastic_strain.empty() || static_cast<int>(plastic_strain.size()) == rest.point_count());
  if (rest.grouped()) return update_macros(rest, tets, x, plastic_strain, pool, elements.macros);
  elements.resize(rest.tet_count());
  const auto body = [&](int begin, int end) {
    double energy = 0;
    int inverted = 0;
    for (int t = begin; t < end; t += 4) {
      if (t + 4 <= end && update_element_quad(rest, tets, t, x, plastic_strain, elements, energy)) continue;  // none of these is inverted
      for (int k = t; k < std::min(t + 4, end); ++k) {
        const Mat34 x_k = gather(x, tets[k]);
        energy += update_element(rest, k, x_k, plastic_strain_at(plastic_strain, k), elements);
        inverted += is_inverted(x_k);
      }
    }
    elements.chunk_energy[begin / kTetsPerChunk] = energy;
    elements.chunk_inverted[begin / kTetsPerChunk] = inverted;
  };
  pool.for_chunks(rest.tet_count(), kTetsPerChunk, std::cref(body));
}

void plastic_flow(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x, double dt,
                  double creep_dt, const ThreadPool& pool, std::vector<Mat3>& plastic_strain, Elements& elements) {
  if (!rest.yields()) return;
  std::array<double, kMaxRegions + 1> creep;  // of each material
  for (int k = 0; k < rest.material_count(); ++k) creep[k] = creep_per_step(rest.material_at(k), dt, creep_dt);
  if (rest.grouped()) return flow_macros(rest, tets, x, creep, pool, plastic_strain, elements.macros);
  elements.resize(rest.tet_count());
  const auto body = [&](int begin, int end) {
    double sum = 0;
    int inverted = 0;
    for (int t = begin; t < end; ++t) {
      const Mat34 x_t = gather(x, tets[t]);
      inverted += is_inverted(x_t);
      const FemMaterial& m = rest.material_of(t);
      const double c = creep[rest.heterogeneous() ? rest.material_id[t] : 0];
      double energy = update_element(rest, t, x_t, plastic_strain[t], elements);
      if (flow(m.flow, element_strain(rest, t, x_t, elements.Q[t]), m.yield, c, m.max_plastic, plastic_strain[t]))
        energy = update_element(rest, t, x_t, plastic_strain[t], elements);
      sum += energy;
    }
    elements.chunk_energy[begin / kTetsPerChunk] = sum;
    elements.chunk_inverted[begin / kTetsPerChunk] = inverted;
  };
  pool.for_chunks(rest.tet_count(), kTetsPerChunk, std::cref(body));
}

void elastic_forces(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                    const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, Elements& elements,
                    Eigen::Ref<Eigen::VectorXd> f) {
  assert(f.size() == 3 * static_cast<Eigen::Index>(x.size()));
  update_elements(rest, tets, x, plastic_strain, pool, elements);
  gather_forces(rest, tets, elements, f);
}

void gather_forces(const RestBody& rest, const std::vector<Tet>& tets, const Elements& elements,
                   Eigen::Ref<Eigen::VectorXd> f) {
  f.setZero();
  if (rest.grouped()) return add_macro_forces(rest, tets, elements.macros, f);
  for (int t = 0; t < rest.tet_count(); ++t)
    for (int a = 0; a < 4; ++a) f.segment<3>(3 * tets[t][a]) += elements.force[t].col(a);
}

double elastic_energy(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                      const std::vector<Mat3>& plastic_strain) {
  if (rest.grouped()) {
    Elements elements;
    update_elements(rest, tets, x, plastic_strain, ThreadPool(1), elements);
    return elastic_energy(rest, elements);
  }
  double energy = 0;
  for (int t = 0; t < rest.tet_count(); ++t) {
    const Mat34 x_t = gather(x, tets[t]);
    const Mat3 Q = rotation(deformation_gradient(x_t, rest.beta[t]), rest.material_of(t).rotation);
    const Mat3 elastic = element_strain(rest, t, x_t, Q) - plastic_strain_at(plastic_strain, t);
    energy += rest.fill[t] * rest.volume[t] * energy_density(rest.lame_of(t), elastic);
  }
  return energy;
}

double elastic_energy(const RestBody& rest, const Elements& elements) {
  if (rest.grouped()) return macro_energy(rest, elements.macros);
  return std::accumulate(elements.chunk_energy.begin(), elements.chunk_energy.end(), 0.0);
}

int inverted_count(const Elements& elements) {
  return std::accumulate(elements.chunk_inverted.begin(), elements.chunk_inverted.end(), 0);
}

int inverted_count(const std::vector<Tet>& tets, const std::vector<Vec3>& x, const ThreadPool& pool) {
  const auto inverted = [&](int begin, int end) {
    int count = 0, t = begin;
    for (; t + 4 <= end; t += 4) count += inverted_of_four(tets, t, x);
    return count + static_cast<int>(std::count_if(tets.begin() + t, tets.begin() + end,
                                                  [&](const Tet& tet) { return is_inverted(gather(x, tet)); }));
  };
  return pool.count_chunks(static_cast<int>(tets.size()), kTetsPerChunk, std::cref(inverted));
}

Eigen::SparseMatrix<double> tangent_stiffness(const RestBody& rest, const std::vector<Tet>& tets,
                                              const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain,
                                              Tangent tangent) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(144 * tets.size());
  if (rest.grouped()) {
    MacroStates elements;
    update_macros(rest, tets, x, plastic_strain, ThreadPool(1), elements);
    add_macro_stiffness(rest, tets, x, plastic_strain, tangent == Tangent::exact, elements, entries);
  } else {
    add_tet_stiffness(rest, tets, x, plastic_strain, tangent, entries);
  }
  const auto size = 3 * static_cast<Eigen::Index>(x.size());
  Eigen::SparseMatrix<double> K(size, size);
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

}  // namespace crumple::sim::fem
