#pragma once

#include "common/types.h"

#include <string>
#include <vector>

namespace crumple::authoring {

// A deformed copy of a surface: the same vertices in the same order, elsewhere (a morph target, what a simulation
// left).
struct DeformedShape {
  std::string name;
  std::vector<Vec3> vertices;  // one a vertex of the surface [m]
};

}  // namespace crumple::authoring
