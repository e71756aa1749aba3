#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>

namespace crumple::scene_convert {

sim::ExampleModel to_example_model(const v1::ExampleBody& message, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
