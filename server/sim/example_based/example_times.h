#pragma once

namespace crumple::sim::example_based {

// Where the processor time of one step of example-based bodies went [ms]; all 0 without a clock. Of one body, or summed over
// bodies that run side by side.
struct ExampleTimes {
  double locate = 0;       // vertices for the points that were struck
  double projection = 0;   // eqs. 4, 5, 8
  double propagation = 0;  // eq. 11
  double weights = 0;      // eqs. 13, 15, and the secondary goal
  double skinning = 0;     // eq. 3, and keeping volume
  double shape = 0;        // mass properties, hulls, proxy, and handing them to the rigid room

  ExampleTimes& operator+=(const ExampleTimes& other) {
    locate += other.locate;
    projection += other.projection;
    propagation += other.propagation;
    weights += other.weights;
    skinning += other.skinning;
    shape += other.shape;
    return *this;
  }
};

}  // namespace crumple::sim::example_based
