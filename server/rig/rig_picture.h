#pragma once

#include "server/sim/example_based/example_set.h"

#include <string>

namespace crumple::rig {

// The body with its handles, then each example from the same side, red by how far it is moved; four in a row.
std::string rig_svg(const sim::example_based::ExampleSet& set);  // with the examples' names
std::string rig_png(const sim::example_based::ExampleSet& set);  // without

}  // namespace crumple::rig
