#pragma once

#include "server/sim/world.h"

namespace crumple::lab {

// How deep finite-element bodies are inside each other and under fixed planes, seen without the contact stage: the largest
// distance to the surface of a body of a vertex of another that lies in one of its tets, or of a vertex to a plane it is
// below [m]; 0 where there is none. Edges that cross are not seen, nor parts of one body, nor rigid shapes but planes.
double vertex_depth(const sim::World& world, const sim::SceneDescription& scene);

}  // namespace crumple::lab
