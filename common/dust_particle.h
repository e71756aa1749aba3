#pragma once

#include "common/types.h"

namespace crumple {

// A grain of dust that leaves a fracture surface, for clients to draw (Parker & O'Brien 2009, section 5).
struct DustParticle {
  Vec3f position;  // in W [m]
  Vec3f velocity;  // of the surface there [m/s]
};

}  // namespace crumple
