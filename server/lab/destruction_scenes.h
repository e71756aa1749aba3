#pragma once

#include "server/sim/scene.h"

#include <cstdint>
#include <map>
#include <string>

// The scenes of Jones et al. 2016 for timing: places, speeds and parameters of the authors' own program, bodies of its
// sizes (vertices N, bones B, examples E) with shapes of our own. docs/example-scenes.md has what was measured beside theirs.
namespace crumple::lab {

struct DestructionOptions {
  std::uint64_t seed = 1;  // of the barrels' orientations, where they fall: their program's are not known
};

// By name:
//   dock         figure 3: three barrels on the edge of a loading dock, dt 4.12 ms
//   pachinko     figure 4: 35 barrels between two planes through 150 pipes, dt 4 ms
//   driver       figure 8: a car into a pyramid of 30 barrels and the dock, dt 5 ms
//   pileup       figure 1: 8 cars over two ramps, dt 4 ms
//   cannonballs  figure 7: a car under 8 balls, a second one from 200 m, dt 4 ms
//   space        figure 10: 17 fighters with jointed wings into a ship of 124 m, dt 4.12 ms
//   shipyard     figure 9: a ship through three cranes of jointed parts, dt 1/480 s
//   pegs         the many-barrels scene of benchmark_scenes.h with barrels that dent
// Errors: another name.
Result<sim::SceneDescription> destruction_scene(const std::string& name, const DestructionOptions& options = {});

// Their names, each with as many steps as show what happens in it.
const std::map<std::string, int>& destruction_steps();

}  // namespace crumple::lab
