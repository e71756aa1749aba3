#pragma once

#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <span>

namespace crumple::sim {

// A graphical mesh carried by a tet mesh (Parker & O'Brien 2009, section 3): each vertex belongs to the tet that
// encloses it, or to the nearest one, and keeps its barycentric coordinates there.
struct Embedding {
  std::vector<int> tet;                 // owning tet, one a vertex
  std::vector<Eigen::Vector4d> weights; // barycentric, sum 1; outside [0, 1] where the nearest tet does not enclose
};

Embedding embed(std::span<const Vec3> vertices, const TetMesh& mesh);

// x_v = sum_k w_k x(tet node k), for node positions x [m]. `out` has one entry a vertex.
void embedded_positions(const Embedding& embedding, const std::vector<Tet>& tets, std::span<const Vec3> x,
                        std::span<Vec3> out);

}  // namespace crumple::sim
