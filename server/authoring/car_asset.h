#pragma once

#include "server/authoring/rig.h"
#include "server/authoring/shapes/car.h"

namespace crumple::authoring {

struct CarAsset {
  CarShape shape;           // 4.2 x 1.7 x 1.4 m
  double cell_size = 0.24;  // [m]; about 1500 nodes
  int bones = 32;           // four of them in the hubs of the wheels
  bool flattened = false;   // with a seventh example: pressed to two fifths of its height, wheels and all
};

// A car towards +x, standing on y = 0, with six examples: rest, crushed_front, crushed_rear, dented_left, dented_right,
// roof_flattened; and flattened, if asked for. Convex parts: front, middle and rear of the body below the windows, the cabin, four wheels.
// Errors: make_rig's.
Result<sim::example_based::ExampleSet> make_car_asset(const CarAsset& car = {});

}  // namespace crumple::authoring
