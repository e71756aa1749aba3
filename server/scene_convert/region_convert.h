#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

namespace crumple::scene_convert {

// The regions of a body whose material is `body`; a tet that several select is of the last of them. A region's material starts from FemMaterial's defaults and has `body`'s
// fields of the whole body.
// Errors: a selection without a rule, a box turned inside out, ids out of range, a tag of a mesh without tags, nothing
// selected or nothing left to a region, a field of the whole body in a region.
std::vector<sim::fem::MaterialRegion> to_regions(const google::protobuf::RepeatedPtrField<v1::MaterialRegion>& messages,
                                                 const sim::fem::FemMaterial& body, const sim::TetMesh& mesh,
                                                 const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
