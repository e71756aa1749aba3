#pragma once

#include "server/sim/scene.h"

// The scenes of Jones et al. 2016 in which things come apart, at the sizes of its authors' files where those are known.
namespace crumple::lab {

// Figure 10: a fleet of 17 fighters, wings jointed to their fuselages, into a ship of 124 m. No gravity.
sim::SceneDescription space(std::uint64_t seed);

// Figure 9: a ship flies through three cranes, which stand in five jointed parts each.
sim::SceneDescription shipyard(std::uint64_t seed);

}  // namespace crumple::lab
