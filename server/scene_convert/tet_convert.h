#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"

#include <memory>
#include <string>

namespace crumple::scene_convert {

// The tet mesh of a source: generated, made around a surface, read or given. Equal sources share one mesh.
// Never null while the conversion holds.
std::shared_ptr<const sim::TetMesh> to_shared_tets(const v1::TetSource& message, const std::string& field,
                                                   Conversion& conversion);

}  // namespace crumple::scene_convert
