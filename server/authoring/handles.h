#pragma once

#include "common/error.h"
#include "server/sim/linear_solver/simultaneous_solve.h"
#include "server/sim/mesh/tet_mesh.h"

#include <string>
#include <vector>

namespace crumple::authoring {

// What an artist moves a body by [Jones et al. 2016, section 4]: a point, or a bone from one point to another.
struct Handle {
  Vec3 from = Vec3::Zero();  // rest position [m]
  Vec3 to = Vec3::Zero();    // the bone's other end; the same as `from`: a point

  static Handle point(const Vec3& p) { return {p, p}; }
  bool is_point() const { return from == to; }
};

// A body's handles; each is a column of the weights, in this order. A cage is points joined by edges or triangles,
// along which weights are linear.
struct Handles {
  std::vector<Handle> handles;
  std::vector<std::array<int, 2>> cage_edges = {};  // ids of points
  std::vector<Triangle> cage_faces = {};            // ids of points

  int count() const { return static_cast<int>(handles.size()); }
};

// Mesh vertices whose weights the handles prescribe, at the resolution of the mesh. A place belongs to the nearest
// corner of the tet that holds it: a point has one vertex, a bone those of all tets it passes, so have a cage's edges
// and faces. Where several want a vertex, points go before cages and cages before bones; several of one kind share it
// equally (two points in one place, bones that meet in a joint).
struct PrescribedWeights {
  std::vector<int> vertices;              // ascending
  sim::linear_solver::RowMatrix weights;  // one row a vertex, one column a handle; in [0, 1], rows sum to 1
  int shared = 0;                         // vertices that several handles of one kind want (cages not counted)
};

// reach: how far outside the mesh a place may lie and still belong to it [m]; 0: the mean length of the mesh's edges.
// Parts of a bone or of a cage that are further away are left out. `mesh` must be valid.
// Errors: no handle or more than kMaxBones, positions that are not finite, a handle all of which is outside, ids of a
// cage that are out of range, repeated or of bones, a bone whose every vertex belongs to points or cages. `field`
// prefixes the error's path.
Result<PrescribedWeights> prescribed_weights(const sim::TetMesh& mesh, const Handles& handles, double reach = 0,
                                             const std::string& field = "handles");

}  // namespace crumple::authoring
