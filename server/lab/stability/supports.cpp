#include "server/lab/stability/supports.h"

#include <cmath>

namespace crumple::lab::stability {

void hold(const std::vector<int>& dofs, Eigen::SparseMatrix<double>& K) {
  const double spring = 1e8 * K.diagonal().maxCoeff();
  for (const int dof : dofs) K.coeffRef(dof, dof) += spring;
}

std::vector<int> held_dofs(const SoftTrial& trial) {
  std::vector<int> dofs;
  for (const sim::fem::PrescribedNode& node : trial.prescribed)
    for (int c = 0; c < 3; ++c) dofs.push_back(3 * node.node + c);
  return dofs;
}

Eigen::VectorXd traction(const sim::TetMesh& mesh, double side, const Vec3& total) {
  Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * mesh.node_count());
  double all = 0;
  for (const sim::SurfaceFace& face : sim::surface_faces(mesh.tets)) {
    const Vec3 a = mesh.X[face.nodes[0]], b = mesh.X[face.nodes[1]], c = mesh.X[face.nodes[2]];
    if (std::abs(a.x() - side) + std::abs(b.x() - side) + std::abs(c.x() - side) > 1e-9) continue;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    all += area;
    for (const int node : face.nodes) f.segment<3>(3 * node) += area / 3 * total;
  }
  return f / all;
}

}  // namespace crumple::lab::stability
