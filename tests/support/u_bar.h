#pragma once

#include "tests/support/kuhn_lattice.h"

#include <algorithm>

namespace crumple::test {

// A bar bent to a U that lies on its side, of cubes of edge H: two arms along x, `arm` cells long and `thick` cells high
// (y), `gap` cells apart, and a base of `thick` cells at x = 0 that joins them; `depth` cells along z. The lower arm's
// lower face is y = 0.
inline sim::TetMesh u_bar(int arm, int thick, int gap, int depth, double H) {
  sim::TetMesh mesh = kuhn_lattice({thick + arm, 2 * thick + gap, depth}, H);
  std::erase_if(mesh.tets, [&](const Tet& tet) {
    Vec3 centre = Vec3::Zero();
    for (const int node : tet) centre += mesh.X[node] / (4 * H);
    return centre.x() > thick && centre.y() > thick && centre.y() < thick + gap;
  });
  std::vector<int> renamed(mesh.X.size(), -1);
  std::vector<Vec3> X;
  for (Tet& tet : mesh.tets)
    for (int& node : tet) {
      if (renamed[node] < 0) {
        renamed[node] = static_cast<int>(X.size());
        X.push_back(mesh.X[node]);
      }
      node = renamed[node];
    }
  mesh.X = std::move(X);
  return mesh;
}

}  // namespace crumple::test
