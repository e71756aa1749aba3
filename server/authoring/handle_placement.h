#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <vector>

namespace crumple::authoring {

// Node ids, ascending, of the vertices on the surface of a tet mesh.
std::vector<int> surface_nodes(const std::vector<Tet>& tets);

// At most `count` of the points `ids`, each as far from those before as possible; the first is the one farthest from
// the points' mean. Ties go to the earlier id.
std::vector<int> farthest_points(const std::vector<Vec3>& X, const std::vector<int>& ids, int count);

// Which of the closest two is removed [Jones et al. 2016, section 4 uses both].
enum class KeepHandle {
  nearest_box,  // the one farther from the mesh's bounding box goes: corners and edges stay
  arbitrary     // the one with the lower id goes
};

// Handles added to those that an artist gave [Jones et al. 2016, section 4]: of the nodes `ids` (of the surface), one
// of the two closest, Euclidean, is removed until `count` are left; returns their ids, ascending. Points that are
// `given` [m] are never removed and count in the distances: a node closest to one of them is the one that goes. With
// count 0 and `given` empty one node stays. More than 4000 nodes are thinned by `farthest_points` first, because the
// removal is quadratic.
struct HandlePlacement {
  KeepHandle keep = KeepHandle::nearest_box;
  std::vector<Vec3> given = {};  // [m]
};
std::vector<int> place_handles(const sim::TetMesh& mesh, std::vector<int> ids, int count,
                               const HandlePlacement& placement = {});

// Their rest positions [m].
std::vector<Vec3> points_of(const sim::TetMesh& mesh, const std::vector<int>& ids);

}  // namespace crumple::authoring
