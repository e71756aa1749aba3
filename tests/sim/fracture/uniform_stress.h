#pragma once

#include "server/sim/fracture/separation_tensor.h"
#include "server/sim/mesh/tet_faces.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::sim::fracture {

// Outward area-weighted normals opposite each node, at rest.
inline std::vector<Mat34> rest_normals(const TetMesh& mesh) {
  std::vector<Mat34> normals(mesh.tet_count());
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Triangle& face = kTetFaces[k];
      const Vec3 &a = mesh.X[mesh.tets[t][face[0]]], &b = mesh.X[mesh.tets[t][face[1]]], &c = mesh.X[mesh.tets[t][face[2]]];
      normals[t].col(k) = (b - a).cross(c - a) / 2;
    }
  return normals;
}

// A mesh at rest under one stress everywhere, and its separation tensors.
struct UniformStress {
  UniformStress(const TetMesh& mesh, const Mat3& sigma, int threads = 1)
      : pool(threads), stars(mesh.tets, mesh.node_count()), stress(mesh.tet_count(), sigma), normals(rest_normals(mesh)),
        S(mesh.node_count()) {
    PartForces forces;
    separation_tensors(mesh.tets, stars, stress, normals, pool, forces, S);
  }

  ThreadPool pool;
  NodeStars stars;
  std::vector<Mat3> stress;
  std::vector<Mat34> normals;
  std::vector<Mat3> S;
};

inline Mat3 uniaxial(const Vec3& direction, double s) {
  const Vec3 e = direction.normalized();
  return s * e * e.transpose();
}

}  // namespace crumple::sim::fracture
