#pragma once

#include "server/authoring/rig_pipeline.h"

#include <nlohmann/json.hpp>

namespace crumple::rig {

// What crumple-rig prints. Lengths in metres.
nlohmann::json summary(const authoring::RigReport& report);
nlohmann::json summary(const authoring::ExampleReport& example);
nlohmann::json summary(const sim::example_based::ExampleSet& set);  // sizes, handles and names of examples

}  // namespace crumple::rig
