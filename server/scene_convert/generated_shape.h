#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/authoring/shapes/barrel.h"
#include "server/authoring/shapes/car.h"
#include "server/authoring/shapes/loft.h"
#include "server/scene_convert/conversion.h"

#include <string>
#include <vector>

namespace crumple::scene_convert {

// `given` or `missing`, within `range`.
double number_or(bool given, double value, double missing, const sim::Range& range, const std::string& field,
                 Conversion& conversion);

// Fields that are missing keep the generator's default.
authoring::BarrelShape to_barrel(const v1::BarrelShape& message, const std::string& field, Conversion& conversion);
std::vector<authoring::Loft> to_lofts(const v1::LoftSurface& message, const std::string& field, Conversion& conversion);
authoring::CarShape to_car(const v1::CarShape& message, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
