#pragma once

#include "server/sim/fem/implicit_euler.h"
#include "tests/support/shared_data.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <random>

namespace crumple::sim::fem::test {

// Box [0, size] of nx x ny x nz cells, six tets a cell around the diagonal 000 -> 111; node (i, j, k) has the index
// (i (ny + 1) + j) (nz + 1) + k.
inline TetMesh kuhn_box(int nx, int ny, int nz, const Vec3& size) {
  TetMesh mesh;
  const auto id = [&](int i, int j, int k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k)
        mesh.X.push_back(size.cwiseProduct(Vec3(double(i) / nx, double(j) / ny, double(k) / nz)));
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k) {
        std::array<int, 3> axes{0, 1, 2};
        do {
          std::array<int, 3> corner{i, j, k};
          Tet tet;
          tet[0] = id(i, j, k);
          for (int a = 0; a < 3; ++a) {
            ++corner[axes[a]];
            tet[a + 1] = id(corner[0], corner[1], corner[2]);
          }
          mesh.tets.push_back(tet);
          if (signed_volume(mesh, mesh.tet_count() - 1) < 0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

// Cells of unit side around 0 with a node in each centre, four tets around each edge between two neighbouring centres, two
// from a centre to each face on the outside; then scaled to [0, size].
inline TetMesh bcc_box(const std::array<int, 3>& n, const Vec3& size) {
  TetMesh mesh;
  std::map<std::array<int, 3>, int> ids;  // by twice the position
  const auto node = [&](const std::array<int, 3>& twice) {
    const auto [at, fresh] = ids.emplace(twice, static_cast<int>(ids.size()));
    if (fresh) mesh.X.push_back(size.cwiseProduct(Vec3(0.5 * twice[0] / n[0], 0.5 * twice[1] / n[1], 0.5 * twice[2] / n[2])));
    return at->second;
  };
  const auto add = [&](Tet tet) {
    mesh.tets.push_back(tet);
    if (signed_volume(mesh, mesh.tet_count() - 1) < 0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
  };
  constexpr int kAround[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int i = 0; i < n[0]; ++i)
    for (int j = 0; j < n[1]; ++j)
      for (int k = 0; k < n[2]; ++k)
        for (int axis = 0; axis < 3; ++axis)
          for (const int side : {-1, 1}) {
            const std::array<int, 3> cell{i, j, k}, centre{2 * i + 1, 2 * j + 1, 2 * k + 1};
            std::array<int, 3> face = centre, next = centre;
            face[axis] += side, next[axis] += 2 * side;
            const bool outside = cell[axis] + side < 0 || cell[axis] + side == n[axis];
            if (side < 0 && !outside) continue;
            std::array<int, 4> f;
            for (int q = 0; q < 4; ++q) {
              std::array<int, 3> corner = face;
              corner[(axis + 1) % 3] += kAround[q][0];
              corner[(axis + 2) % 3] += kAround[q][1];
              f[q] = node(corner);
            }
            const int c = node(centre), diagonal = (i + j + k) % 2;
            if (outside) {
              add({c, f[diagonal], f[diagonal + 1], f[diagonal + 2]});
              add({c, f[diagonal], f[diagonal + 2], f[(diagonal + 3) % 4]});
            } else {
              for (int q = 0; q < 4; ++q) add({c, node(next), f[q], f[(q + 1) % 4]});
            }
          }
  return mesh;
}

// Edge length sqrt(8), centred on the origin.
inline TetMesh regular_tet() {
  TetMesh mesh;
  mesh.X = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};
  mesh.tets = {{0, 1, 2, 3}};
  if (signed_volume(mesh, 0) < 0) std::swap(mesh.tets[0][2], mesh.tets[0][3]);
  return mesh;
}

inline FemState rest_state(const TetMesh& mesh) {
  return {mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), std::vector<Mat3>(mesh.tets.size(), Mat3::Zero())};
}

inline RestBody rest_body(const TetMesh& mesh, const FemMaterial& material, double clamp_limit = 0,
                          std::span<const MaterialRegion> regions = {},
                          ElementKind element = ElementKind::linear_tetrahedra) {
  Result<RestBody> rest = make_rest_body(mesh, material, clamp_limit, regions, element);
  EXPECT_TRUE(rest.has_value());
  return std::move(*rest);
}

inline Eigen::VectorXd gravity_force(const RestBody& rest, const Vec3& g) {
  Eigen::VectorXd f(3 * rest.node_count());
  for (int i = 0; i < rest.node_count(); ++i) f.segment<3>(3 * i) = rest.node_mass[i] * g;
  return f;
}

class Random {
 public:
  explicit Random(unsigned seed = 1) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3 vec3(double low, double high) {
    return Vec3::NullaryExpr([&] { return uniform(low, high); });
  }
  Mat3 mat3(double low, double high) {
    return Mat3::NullaryExpr([&] { return uniform(low, high); });
  }
  Mat3 rotation() {
    return Quat(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized().toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
};

inline double kinetic_energy(const RestBody& rest, const FemState& s) {
  double sum = 0;
  for (int i = 0; i < rest.node_count(); ++i) sum += 0.5 * rest.node_mass[i] * s.v[i].squaredNorm();
  return sum;
}
inline Vec3 momentum(const RestBody& rest, const FemState& s) {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < rest.node_count(); ++i) sum += rest.node_mass[i] * s.v[i];
  return sum;
}
inline Vec3 angular_momentum(const RestBody& rest, const FemState& s) {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < rest.node_count(); ++i) sum += rest.node_mass[i] * s.x[i].cross(s.v[i]);
  return sum;
}
inline Vec3 centre_of_mass(const RestBody& rest, const FemState& s) {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < rest.node_count(); ++i) sum += rest.node_mass[i] * s.x[i];
  return sum / rest.mass();
}

// Tip of a cantilever of 2 x 0.4 x 0.4 m under a shear force at its end, over Timoshenko's. Linear.
inline double cantilever_tip(bool bcc, const FemMaterial& material, ElementKind element) {
  const TetMesh mesh = bcc ? bcc_box({16, 3, 3}, {2, 0.4, 0.4}) : kuhn_box(16, 3, 3, {2, 0.4, 0.4});
  const double inertia = std::pow(0.4, 4) / 12, shear = material.young / (2 * (1 + material.poisson));
  const double exact = 8.0 / (3 * material.young * inertia) + 2 / (0.85 * 0.16 * shear);  // of 1 N
  const RestBody rest = rest_body(mesh, material, 0, {}, element);
  Eigen::MatrixXd K = tangent_stiffness(rest, mesh.tets, mesh.X, std::vector<Mat3>(rest.point_count(), Mat3::Zero()), Tangent::fixed_rotation);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(K.rows());
  double area = 0;
  for (const SurfaceFace& face : surface_faces(mesh.tets)) {
    const Vec3 a = mesh.X[face.nodes[0]], b = mesh.X[face.nodes[1]], c = mesh.X[face.nodes[2]];
    if (std::min({a.x(), b.x(), c.x()}) < 2 - 1e-9) continue;
    for (const int n : face.nodes) f[3 * n + 1] += 0.5 * (b - a).cross(c - a).norm() / 3 / 0.16;
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  EXPECT_NEAR(area, 0.16, 1e-12);
  for (int n = 0; n < mesh.node_count(); ++n) {
    if (mesh.X[n].x() > 1e-9) continue;
    for (int d = 3 * n; d < 3 * n + 3; ++d) {
      K.row(d).setZero();
      K.col(d).setZero();
      K(d, d) = 1;
    }
  }
  return f.dot(K.ldlt().solve(f)) / exact;
}

inline nlohmann::json read_json(const std::string& name) {
  std::ifstream file(crumple::test::shared_data(name));
  return nlohmann::json::parse(file);
}
inline Mat3 to_mat3(const nlohmann::json& rows) {
  Mat3 m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m(i, j) = rows[i][j].get<double>();
  return m;
}

}  // namespace crumple::sim::fem::test
