#pragma once

#include "server/sim/example_based/example_set.h"

#include <string>

namespace crumple::rig {

// An SVG: the body with its handles, then each example from the same side, red by how far it is moved. Four in a row.
std::string rig_picture(const sim::example_based::ExampleSet& set);

}  // namespace crumple::rig
