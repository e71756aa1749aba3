#pragma once

#include "server/authoring/rig.h"
#include "server/authoring/shapes/barrel.h"

namespace crumple::authoring {

struct BarrelAsset {
  BarrelShape shape;         // .66 x .9 m
  double cell_size = 0.095;  // [m]; about 1200 nodes
  int bone_rings = 3;        // bones stand on the side, in rings from rim to rim ...
  int bones_a_ring = 6;      // ... evenly around: the poses come out as regular as the barrel
};

// A barrel along y, centred on the origin, with five examples:
//   rest
//   crushed_side  flattened from +x, swollen across
//   squashed      shortened along its axis, bellied
//   bent          kinked at half height about z, pressed together on the +x side; bones turn with it
//   crumpled      drawn in all round, in three lobes: because example weights vary over the body, this is what lets it
//                 dent from any side
// One convex part. Errors: make_rig's.
Result<sim::example_based::ExampleSet> make_barrel_asset(const BarrelAsset& barrel = {});

}  // namespace crumple::authoring
