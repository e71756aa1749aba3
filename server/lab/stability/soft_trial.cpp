#include "server/lab/stability/soft_trial.h"

#include "server/authoring/shapes/box_lattice.h"
#include "server/lab/stability/step_times.h"
#include "server/sim/mesh/tet_faces.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>

namespace crumple::lab::stability {

using namespace sim::fem;

namespace {

constexpr double kFar = 1e3;  // [m]: no body of a trial has business there

RestBody make_rest(const sim::TetMesh& mesh, FemMaterial material, const FemMethod& method) {
  if (method.choose) method.choose(material);
  return std::move(make_rest_body(mesh, material, 0, {}, method.element).value());
}

}  // namespace

SoftTrial::SoftTrial(const sim::TetMesh& mesh_, FemMaterial material, const FemMethod& method_)
    : mesh(mesh_),
      method(method_),
      rest(make_rest(mesh_, material, method_)),
      state{mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()),
            std::vector<Mat3>(rest.point_count(), Mat3::Zero())},
      force(Eigen::VectorXd::Zero(3 * mesh.node_count())),
      scratch(method_.float_matrix) {}

void SoftTrial::deform(const std::function<Vec3(const Vec3&)>& map) {
  for (int i = 0; i < mesh.node_count(); ++i) {
    state.x[i] = map(mesh.X[i]);
    state.v[i].setZero();
  }
  forget(state);
}

void SoftTrial::run(double seconds, double dt, const std::function<bool()>& after_step) {
  largest_kinetic = kinetic();
  largest_energy = energy();
  worst_residual = 0;
  capped = 0;
  const long steps = std::max(1L, std::lround(seconds / dt));
  std::vector<double> times;
  for (long k = 0; k < steps && sound(); ++k) {
    const double from = processor_time();
    const auto report = method.step(*this, dt);
    times.push_back(processor_time() - from);
    worst_residual = std::max(worst_residual, report.residual);
    capped += !report.converged;
    const double T = kinetic();
    largest_kinetic = std::max(largest_kinetic, T);
    largest_energy = std::max(largest_energy, T + elastic());
    if (after_step && !after_step()) break;
  }
  if (method.times) method.times->add(std::move(times));
}

double SoftTrial::kinetic() const {
  double sum = 0;
  for (int i = 0; i < mesh.node_count(); ++i) sum += 0.5 * rest.node_mass[i] * state.v[i].squaredNorm();
  return sum;
}

double SoftTrial::elastic() const {
  if (rest.grouped()) return elastic_energy(rest, mesh.tets, state.x, state.plastic_strain);
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Mat34 x = gather(state.x, mesh.tets[t]);
    const Mat3 Q = method.rotation(deformation_gradient(x, rest.beta[t]));
    sum += rest.volume[t] * energy_density(rest.lame, element_strain(rest, t, x, Q) - state.plastic_strain[t]);
  }
  return sum;
}

Vec3 SoftTrial::momentum() const {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < mesh.node_count(); ++i) sum += rest.node_mass[i] * state.v[i];
  return sum;
}

Vec3 SoftTrial::centre() const {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < mesh.node_count(); ++i) sum += rest.node_mass[i] * state.x[i];
  return sum / rest.mass();
}

Vec3 SoftTrial::angular_momentum() const {
  const Vec3 c = centre();
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < mesh.node_count(); ++i) sum += rest.node_mass[i] * (state.x[i] - c).cross(state.v[i]);
  return sum;
}

double SoftTrial::rigid_kinetic() const {
  const Vec3 c = centre(), L = angular_momentum(), P = momentum();
  Mat3 I = Mat3::Zero();
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Vec3 r = state.x[i] - c;
    I += rest.node_mass[i] * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
  }
  return 0.5 * (P.squaredNorm() / rest.mass() + L.dot(I.ldlt().solve(L)));
}

double SoftTrial::spin() const {
  Vec3 c = Vec3::Zero();
  for (int i = 0; i < mesh.node_count(); ++i) c += rest.node_mass[i] * mesh.X[i] / rest.mass();
  double second_moment = 0;
  for (int i = 0; i < mesh.node_count(); ++i) second_moment += rest.node_mass[i] * (mesh.X[i] - c).squaredNorm();
  return angular_momentum().norm() / (2.0 / 3 * second_moment);
}

int SoftTrial::inverted() const { return inverted_count(mesh.tets, state.x, pool); }

double SoftTrial::shape_error() const {
  const double n = static_cast<double>(mesh.X.size());
  Vec3 X_mean = Vec3::Zero(), x_mean = Vec3::Zero();
  for (std::size_t i = 0; i < mesh.X.size(); ++i) {
    X_mean += mesh.X[i] / n;
    x_mean += state.x[i] / n;
  }
  Mat3 H = Mat3::Zero();
  for (std::size_t i = 0; i < mesh.X.size(); ++i) H += (state.x[i] - x_mean) * (mesh.X[i] - X_mean).transpose();
  if (!H.allFinite()) return std::nan("");
  const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Mat3 R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  double worst = 0;
  for (std::size_t i = 0; i < mesh.X.size(); ++i)
    worst = std::max(worst, (R * (mesh.X[i] - X_mean) - (state.x[i] - x_mean)).norm());
  return worst;
}

bool SoftTrial::sound() const {
  return std::ranges::all_of(state.x, [](const Vec3& x) { return x.allFinite() && x.cwiseAbs().maxCoeff() < kFar; }) &&
         std::ranges::all_of(state.v, [](const Vec3& v) { return v.allFinite(); });
}

sim::TetMesh block(const Vec3& size, const std::array<int, 3>& cells) {
  return *authoring::box_mesh({size, cells, authoring::Lattice::kuhn, Vec3::Zero()});
}

sim::TetMesh unit_cube(int n) { return block(Vec3::Ones(), {n, n, n}); }

sim::TetMesh cube_with_sliver(int n, double quality) {
  sim::TetMesh mesh = unit_cube(n);
  for (const Tet& tet : mesh.tets)
    for (int k = 0; k < 4; ++k) {
      const Vec3 X = mesh.X[tet[k]];
      if (X.minCoeff() < 1e-9 || X.maxCoeff() > 1 - 1e-9) continue;  // on the surface
      const Triangle& face = sim::kTetFaces[k];
      const Vec3 a = mesh.X[tet[face[0]]], b = mesh.X[tet[face[1]]], c = mesh.X[tet[face[2]]];
      const Vec3 foot = (a + b + c) / 3;
      mesh.X[tet[k]] = foot + quality * (X - foot);
      return mesh;
    }
  return mesh;
}

FemMaterial soft_material() {
  FemMaterial material;
  material.young = 1e5;
  return material;
}

Vec3 Random::vec3(double low, double high) {
  const double x = uniform(low, high), y = uniform(low, high);
  return {x, y, uniform(low, high)};
}

void scramble(SoftTrial& trial, std::uint64_t seed, double low, double high) {
  Random random(seed);
  trial.deform([&](const Vec3&) { return random.vec3(low, high); });
}

}  // namespace crumple::lab::stability
