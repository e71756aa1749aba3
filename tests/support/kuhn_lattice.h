#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <utility>

namespace crumple::test {

// cells[0] x cells[1] x cells[2] cubes of edge H, from the origin, each cut into the six tets around its diagonal
// (0,0,0)-(1,1,1): the same cut in every cube, so the lattice fits together. Node (i, j, k) is
// i + (cells[0] + 1) (j + (cells[1] + 1) k).
inline sim::TetMesh kuhn_lattice(std::array<int, 3> cells, double H) {
  sim::TetMesh mesh;
  for (int k = 0; k <= cells[2]; ++k)
    for (int j = 0; j <= cells[1]; ++j)
      for (int i = 0; i <= cells[0]; ++i) mesh.X.push_back(H * Vec3(i, j, k));
  const auto node = [&](const std::array<int, 3>& c) { return c[0] + (cells[0] + 1) * (c[1] + (cells[1] + 1) * c[2]); };
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        for (const auto& path : kPaths) {  // one tet for each order in which a walk along the edges takes the axes
          std::array<int, 3> at{i, j, k};
          Tet tet{node(at), 0, 0, 0};
          for (int s = 0; s < 3; ++s) {
            ++at[path[s]];
            tet[s + 1] = node(at);
          }
          mesh.tets.push_back(tet);
          if (sim::signed_volume(mesh, mesh.tet_count() - 1) < 0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
        }
  return mesh;
}

}  // namespace crumple::test
