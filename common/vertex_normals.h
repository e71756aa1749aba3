#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple {

// Outward unit normals of drawn vertices: sums of their triangles' area vectors, made unit length. What a client needs
// for smooth shading; frames do not carry them, since positions and triangles say them. A vertex without area gets zero.
// positions: one a vertex of the topology, as in BodyFrame (or BodyTopology::vertices of a rigid body) [m].
// triangles: of the topology, counter-clockwise seen from outside; ids in range. normals: sized here; memory is kept.
void vertex_normals(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::vector<Vec3f>& normals);

}  // namespace crumple
