#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>

namespace crumple::scene_convert {

sim::FemModel to_fem(const v1::FemBody& message, const std::string& field, Conversion& conversion);

// A field that is missing keeps FemMaterial's default.
sim::fem::FemMaterial to_material(const v1::FemMaterial& message, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
