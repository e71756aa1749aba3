#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <vector>

namespace crumple::authoring {

// Node ids, ascending, of the vertices on the surface of a tet mesh.
std::vector<int> surface_nodes(const std::vector<Tet>& tets);

// At most `count` of the points `ids`, each as far from those before as possible; the first is the one farthest from
// the points' mean. Ties go to the earlier id.
std::vector<int> farthest_points(const std::vector<Vec3>& X, const std::vector<int>& ids, int count);

// Bones for a rig: of the nodes `ids` (of the surface), one of the two closest is removed until `count` are left, the
// one farther from the mesh's bounding box [Jones et al. 2016, section 4]; ascending node ids. More than 4000 nodes are
// thinned by `farthest_points` first, because the removal is quadratic.
std::vector<int> place_handles(const sim::TetMesh& mesh, std::vector<int> ids, int count);

// Their rest positions [m].
std::vector<Vec3> points_of(const sim::TetMesh& mesh, const std::vector<int>& ids);

}  // namespace crumple::authoring
