#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"

#include <memory>
#include <string>

namespace crumple::scene_convert {

// The surface of a source: generated, read or given. Equal sources share one mesh.
// Never null while the conversion holds.
std::shared_ptr<const sim::SurfaceMesh> to_shared_surface(const v1::SurfaceSource& message, const std::string& field,
                                                          Conversion& conversion);

}  // namespace crumple::scene_convert
