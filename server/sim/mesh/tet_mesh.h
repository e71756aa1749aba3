#pragma once

#include "common/error.h"
#include "common/types.h"

#include <vector>

namespace crumple::sim {

// A tetrahedral mesh at rest. Topology may change by fracture (fracture/mesh_split.h); rest positions do not.
struct TetMesh {
  std::vector<Vec3> X;        // rest positions, one a node [m]
  std::vector<Tet> tets;      // positive volume
  std::vector<double> fill;   // fraction of each tet that is material, (0, 1]; empty = 1 everywhere
  std::vector<int> tags = {};  // one a tet, as its author numbered its parts; empty = none

  int node_count() const { return static_cast<int>(X.size()); }
  int tet_count() const { return static_cast<int>(tets.size()); }
};

// Rest positions of the corners of tet t, in columns [m].
Mat34 rest_corners(const TetMesh& mesh, int t);

// det(X1-X0, X2-X0, X3-X0) / 6 of tet t [m^3].
double signed_volume(const TetMesh& mesh, int t);

// Faces that belong to one tet only, counter-clockwise seen from outside, in mesh order of their tets.
struct SurfaceFace {
  Triangle nodes;
  int tet;       // the tet it belongs to
  int opposite;  // local index 0..3 of the node that is not on it
};
std::vector<SurfaceFace> surface_faces(const std::vector<Tet>& tets);

// Size limits of what the server accepts.
inline constexpr int kMaxTets = 2'000'000;

// Rejects: no tet, too many tets, non-finite positions, ids out of range, repeated ids in a tet,
// volume <= 1e-12 of the cubed longest edge, fill outside (0, 1], a fill or tags array of another size.
// `field` prefixes the error's path.
Result<void> validate(const TetMesh& mesh, const std::string& field);

}  // namespace crumple::sim
