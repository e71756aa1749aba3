#include "server/sim/rigid/mass_properties.h"

#include <Eigen/Eigenvalues>

#include <cassert>
#include <cmath>
#include <numbers>

#include "server/sim/rigid/convex_hull.h"

namespace crumple::sim {
namespace {

Mat3 inertia_of_second_moment(const Mat3& C) { return C.trace() * Mat3::Identity() - C; }

// Running integrals of rho, rho y and rho y y^T, y = x - reference (a point near the solid, against cancellation).
struct Moments {
  Vec3 reference = Vec3::Zero();
  double mass = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  // Tet of the four given points with an evenly spread (signed) mass m:
  //   int y y^T = m/20 (sum_i y_i y_i^T + s s^T), s = sum_i y_i.
  void add_tet(double m, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 y[4] = {a - reference, b - reference, c - reference, d - reference};
    const Vec3 s = y[0] + y[1] + y[2] + y[3];
    mass += m;
    first += m / 4 * s;
    second += m / 20 *
              (y[0] * y[0].transpose() + y[1] * y[1].transpose() + y[2] * y[2].transpose() + y[3] * y[3].transpose() +
               s * s.transpose());
  }

  MassProperties finish() const {
    if (mass == 0) return {};
    const Vec3 mean = first / mass;
    return {mass, reference + mean, inertia_of_second_moment(second - mass * mean * mean.transpose())};
  }
};

double signed_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).dot((c - a).cross(d - a)) / 6;
}

Vec3 mean(std::span<const Vec3> x) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : x) sum += p;
  return x.empty() ? sum : Vec3(sum / static_cast<double>(x.size()));
}

}  // namespace

MassProperties box_mass(const Vec3& half_extents, double density) {
  const double m = density * 8 * half_extents.prod();
  const Vec3 q = half_extents.cwiseAbs2() / 3;
  return {m, Vec3::Zero(), (m * Vec3(q.y() + q.z(), q.z() + q.x(), q.x() + q.y())).asDiagonal()};
}

MassProperties sphere_mass(double radius, double density) {
  const double m = density * 4 / 3 * std::numbers::pi * radius * radius * radius;
  return {m, Vec3::Zero(), 0.4 * m * radius * radius * Mat3::Identity()};
}

MassProperties cylinder_mass(double radius, double half_length, double density) {
  const double m = density * 2 * half_length * std::numbers::pi * radius * radius;
  const double across = m * (radius * radius / 4 + half_length * half_length / 3);
  return {m, Vec3::Zero(), Vec3(across, m * radius * radius / 2, across).asDiagonal()};
}

MassProperties closed_mesh_mass(const SurfaceMesh& mesh, double density) {
  Moments moments{.reference = mean(mesh.vertices)};
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    moments.add_tet(density * signed_volume(moments.reference, a, b, c), moments.reference, a, b, c);
  }
  return moments.finish();
}

MassProperties tet_mass(std::span<const Tet> tets, std::span<const Vec3> x, std::span<const double> tet_masses) {
  assert(tets.size() == tet_masses.size());
  Moments moments{.reference = mean(x)};
  for (std::size_t t = 0; t < tets.size(); ++t) {
    moments.add_tet(tet_masses[t], x[tets[t][0]], x[tets[t][1]], x[tets[t][2]], x[tets[t][3]]);
  }
  return moments.finish();
}

std::vector<double> tet_masses(const TetMesh& mesh, double density) {
  std::vector<double> masses(mesh.tets.size());
  for (std::size_t t = 0; t < masses.size(); ++t) {
    const Tet& n = mesh.tets[t];
    const double fill = mesh.fill.empty() ? 1.0 : mesh.fill[t];
    masses[t] = density * fill * signed_volume(mesh.X[n[0]], mesh.X[n[1]], mesh.X[n[2]], mesh.X[n[3]]);
  }
  return masses;
}

MassProperties point_mass(std::span<const Vec3> x, std::span<const double> masses) {
  assert(x.size() == masses.size());
  Moments moments{.reference = mean(x)};
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 y = x[i] - moments.reference;
    moments.mass += masses[i];
    moments.first += masses[i] * y;
    moments.second += masses[i] * y * y.transpose();
  }
  return moments.finish();
}

MassProperties combined(std::span<const MassProperties> parts) {
  MassProperties sum;
  for (const MassProperties& part : parts) {
    sum.mass += part.mass;
    sum.com += part.mass * part.com;
  }
  if (sum.mass == 0) return {};
  sum.com /= sum.mass;
  for (const MassProperties& part : parts) sum.inertia += inertia_about(part, sum.com);
  return sum;
}

MassProperties placed(const MassProperties& properties, const Pose& X_BS) {
  const Mat3 R = X_BS.R_WB.toRotationMatrix();
  return {properties.mass, X_BS * properties.com, R * properties.inertia * R.transpose()};
}

MassProperties with_mass(const MassProperties& properties, double mass) {
  assert(properties.mass > 0);
  return {mass, properties.com, mass / properties.mass * properties.inertia};
}

Mat3 inertia_about(const MassProperties& properties, const Vec3& p) {
  const Vec3 d = properties.com - p;
  return properties.inertia + properties.mass * inertia_of_second_moment(d * d.transpose());
}

namespace {

struct ShapeMass {
  double density;
  std::string field;

  Result<MassProperties> operator()(const Box& box) const { return box_mass(box.half_extents, density); }
  Result<MassProperties> operator()(const Sphere& sphere) const { return sphere_mass(sphere.radius, density); }
  Result<MassProperties> operator()(const Cylinder& c) const { return cylinder_mass(c.radius, c.half_length, density); }
  Result<MassProperties> operator()(const Plane&) const {
    return invalid(field, "is a plane, which only a fixed body may have");
  }
  Result<MassProperties> operator()(const ConvexHull& hull) const {
    const Result<SurfaceMesh> surface = convex_hull(hull.points, field);
    if (!surface) return std::unexpected(surface.error());
    return closed_mesh_mass(*surface, density);
  }
  Result<MassProperties> operator()(const TriangleShape& triangles) const {
    const MassProperties properties = closed_mesh_mass(triangles.mesh, 1);
    Eigen::AlignedBox3d box;
    for (const Vec3& p : triangles.mesh.vertices) box.extend(p);
    if (!(properties.mass > 1e-9 * std::pow(box.diagonal().norm(), 3))) {
      return invalid(field, "encloses no volume: the triangles of a moving body must be closed and point outward");
    }
    return with_mass(properties, density * properties.mass);
  }
};

}  // namespace

Result<MassProperties> shapes_mass(const std::vector<PlacedShape>& shapes, double density, const std::string& field) {
  if (shapes.empty()) return invalid(field, "is empty, a moving body needs at least one shape");
  std::vector<MassProperties> parts;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::string name = field + "[" + std::to_string(i) + "]";
    const Result<MassProperties> part = std::visit(ShapeMass{density, name}, shapes[i].shape);
    if (!part) return part;
    parts.push_back(placed(*part, shapes[i].pose));
  }
  const MassProperties sum = combined(parts);
  if (!(sum.mass > 0) || !std::isfinite(sum.mass) || !sum.inertia.allFinite() || !sum.com.allFinite()) {
    return invalid(field, "have a mass of " + std::to_string(sum.mass) + " kg, must be positive and finite");
  }
  return sum;
}

PrincipalAxes principal_axes(const Mat3& inertia) {
  const double scale = inertia.diagonal().cwiseAbs().maxCoeff();
  const Vec3 off(inertia(1, 0), inertia(2, 0), inertia(2, 1));
  PrincipalAxes axes;
  if (off.cwiseAbs().maxCoeff() <= 1e-12 * scale) {
    axes.moments = inertia.diagonal();
  } else {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(inertia);
    const Mat3& V = eigen.eigenvectors();
    // The order of the columns whose diagonal is largest; the first one wins ties.
    static constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const int* best = kOrders[0];
    double best_sum = -1;
    for (const auto& order : kOrders) {
      const double sum = std::abs(V(0, order[0])) + std::abs(V(1, order[1])) + std::abs(V(2, order[2]));
      if (sum > best_sum + 1e-12) best_sum = sum, best = order;
    }
    for (int k = 0; k < 3; ++k) {
      axes.R_BP.col(k) = V.col(best[k]) * (V(k, best[k]) < 0 ? -1.0 : 1.0);
      axes.moments[k] = eigen.eigenvalues()[best[k]];
    }
    if (axes.R_BP.determinant() < 0) {  // turn the axis that points least where it should
      int k = 0;
      axes.R_BP.diagonal().minCoeff(&k);
      axes.R_BP.col(k) *= -1;
    }
  }
  axes.moments = axes.moments.cwiseMax(1e-6 * axes.moments.maxCoeff());
  return axes;
}

}  // namespace crumple::sim
