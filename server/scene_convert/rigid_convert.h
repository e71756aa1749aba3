#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>

namespace crumple::scene_convert {

// Bodies with triangle shapes get proxy tets here: an enclosing mesh of their triangles.
sim::RigidModel to_rigid(const v1::RigidBody& message, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
