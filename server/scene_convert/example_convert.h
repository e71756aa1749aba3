#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>

namespace crumple::scene_convert {

// Error: a number that names no goal.
Result<sim::example_based::ExampleParameters::SecondaryGoal> to_secondary_goal(int goal, const std::string& field);

sim::ExampleModel to_example_model(const v1::ExampleBody& message, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
