#include "server/sim/fem/hexahedron.h"

#include "server/sim/quad.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <cmath>

namespace crumple::sim::fem {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat24 = Eigen::Matrix<double, 24, 24>;
using Mat6x24 = Eigen::Matrix<double, 6, 24>;
using Mat6x9 = Eigen::Matrix<double, 6, 9>;
using Mat9x24 = Eigen::Matrix<double, 9, 24>;

Vec3 reference_corner(int a) { return {a & 1 ? 1.0 : -1.0, a & 2 ? 1.0 : -1.0, a & 4 ? 1.0 : -1.0}; }

Vec3 gauss_point(int k) { return reference_corner(k) / std::sqrt(3.0); }  // of weight 1

// Gradients of the trilinear functions in reference coordinates, in the columns.
Mat38 trilinear_gradients(const Vec3& xi) {
  Mat38 d;
  for (int a = 0; a < 8; ++a) {
    const Vec3 s = reference_corner(a), one = (s.cwiseProduct(xi)).array() + 1;
    d.col(a) = Vec3(s.x() * one.y() * one.z(), one.x() * s.y() * one.z(), one.x() * one.y() * s.z()) / 8;
  }
  return d;
}

// Engineering strain of a displacement u N, by u, where N has this gradient.
Eigen::Matrix<double, 6, 3> strain_of(const Vec3& gradient) {
  const double x = gradient.x(), y = gradient.y(), z = gradient.z();
  Eigen::Matrix<double, 6, 3> B;
  B << x, 0, 0, 0, y, 0, 0, 0, z, y, x, 0, 0, z, y, z, 0, x;
  return B;
}

Mat6 elasticity(const Lame& lame) {
  Mat6 C = Mat6::Zero();
  C.topLeftCorner<3, 3>().setConstant(lame.lambda);
  C.topLeftCorner<3, 3>() += 2 * lame.mu * Mat3::Identity();
  C.bottomRightCorner<3, 3>() = lame.mu * Mat3::Identity();
  return C;
}

// The strains of nodes and of incompatible modes at a point of the cell.
struct Point {
  Mat6x24 B;
  Mat6x9 incompatible;
  double jacobian;
};

Point point_at(const Mat38& X, const Vec3& xi, const Mat3& J0) {
  const Mat38 d = trilinear_gradients(xi);
  const Mat3 J = X * d.transpose();
  Point p;
  p.jacobian = J.determinant();
  const Mat3 to_gradient = J.inverse().transpose();
  for (int a = 0; a < 8; ++a) p.B.middleCols<3>(3 * a) = strain_of(to_gradient * d.col(a));
  // By the centre's Jacobian, which makes their mean strain zero: the patch test (Taylor, Beresford & Wilson).
  const Mat3 mode_gradient = J0.determinant() / p.jacobian * J0.inverse().transpose();
  for (int k = 0; k < 3; ++k) p.incompatible.middleCols<3>(3 * k) = strain_of(-2 * xi[k] * mode_gradient.col(k));
  return p;
}

// The largest x . K x / x . D x, D the block diagonal of K.
double spectral_bound(const Mat24& K) {
  Mat24 scaled = K;
  for (int a = 0; a < 8; ++a) {
    const Mat3 L = K.block<3, 3>(3 * a, 3 * a).llt().matrixL();
    scaled.middleRows<3>(3 * a) = L.triangularView<Eigen::Lower>().solve(scaled.middleRows<3>(3 * a).eval());
    scaled.middleCols<3>(3 * a) = L.triangularView<Eigen::Lower>().solve(scaled.middleCols<3>(3 * a).transpose().eval()).transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Mat24>(scaled, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

// y -> y less its affine part, by the mean gradient.
Mat24 without_affine(const Mat38& X, const Mat38& g) {
  const Vec3 middle = X.rowwise().mean();
  Mat24 P;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b)
      P.block<3, 3>(3 * a, 3 * b) = ((a == b) - 1.0 / 8 - g.col(b).dot(X.col(a) - middle)) * Mat3::Identity();
  return P;
}

}  // namespace

std::array<Vec3, 8> HexahedronShape::forces(const Mat38& Y) const {
  std::array<Vec3, 8> f;
  for (int a = 0; a < 8; ++a) {
    Quad sum[3]{};
    for (int b = 0; b < 8; ++b) {
      const double* H_ab = H[8 * a + b].data();
      sum[0] = multiply_add(load_four(H_ab), quad(Y(0, b)), sum[0]);
      sum[1] = multiply_add(load_four(H_ab + 3), quad(Y(1, b)), sum[1]);
      sum[2] = multiply_add(load_three(H_ab + 6), quad(Y(2, b)), sum[2]);
    }
    store_three(sum[0] + sum[1] + sum[2], f[a].data());
  }
  return f;
}

Mat3 HexahedronShape::strain_deviation(int tet, const Mat38& Y) const {
  const Vec6 e = deviation[tet] * Eigen::Map<const Eigen::Matrix<double, 24, 1>>(Y.data());
  Mat3 strain;
  strain << e[0], e[3] / 2, e[5] / 2, e[3] / 2, e[1], e[4] / 2, e[5] / 2, e[4] / 2, e[2];
  return strain;
}

double trilinear_volume(const Mat38& X) {
  double volume = 0;
  for (int k = 0; k < 8; ++k) volume += (X * trilinear_gradients(gauss_point(k)).transpose()).determinant();
  return volume;
}

std::optional<HexahedronShape> hexahedron_shape(const Mat38& X, const Mat38& g, const HexahedronTets& tets, const Lame& lame,
                                                double filled, double share) {
  const Mat3 J0 = X * trilinear_gradients(Vec3::Zero()).transpose();
  const double least = kFlattest * J0.determinant();
  if (!(least > 0)) return {};
  for (int a = 0; a < 8; ++a)
    if (!((X * trilinear_gradients(reference_corner(a)).transpose()).determinant() >= least)) return {};

  const Mat6 C = elasticity(lame);
  Mat24 K = Mat24::Zero();
  Eigen::Matrix<double, 9, 9> of_modes = Eigen::Matrix<double, 9, 9>::Zero();
  Mat9x24 coupling = Mat9x24::Zero();
  for (int k = 0; k < 8; ++k) {
    const Point p = point_at(X, gauss_point(k), J0);
    K += p.jacobian * p.B.transpose() * C * p.B;
    of_modes += p.jacobian * p.incompatible.transpose() * C * p.incompatible;
    coupling += p.jacobian * p.incompatible.transpose() * C * p.B;
  }
  const Mat9x24 modes = -of_modes.llt().solve(coupling);  // of the displacement of the nodes
  K += coupling.transpose() * modes;
  Mat6x24 mean;
  for (int a = 0; a < 8; ++a) mean.middleCols<3>(3 * a) = strain_of(g.col(a));
  const Mat24 P = without_affine(X, g);
  const Mat24 H = share * (P.transpose() * K * P);

  HexahedronShape shape;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b)
      shape.H[8 * a + b] = 0.5 * (H.block<3, 3>(3 * a, 3 * b) + H.block<3, 3>(3 * b, 3 * a).transpose());
  shape.spectral_bound = spectral_bound(filled * mean.transpose() * C * mean + H);
  for (int t = 0; t < 6; ++t) {
    Vec3 xi = Vec3::Zero();
    for (const int a : tets[t]) xi += reference_corner(a) / 4;
    const Point p = point_at(X, xi, J0);
    shape.deviation[t] = (p.B + p.incompatible * modes) * P;
  }
  return shape;
}

}  // namespace crumple::sim::fem
