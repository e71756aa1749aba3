#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"

#include <memory>
#include <string>

namespace crumple::scene_convert {

// The splinters of a body that has some: of `render`, or of the tets' own surface where that is null. Equal ones share one
// mesh. `field`: of the body. Never null while the conversion holds.
std::shared_ptr<const sim::SplinterMesh> to_shared_splinters(const v1::FemBody& body, const sim::TetMesh& mesh,
                                                             const sim::SurfaceMesh* render, const std::string& field,
                                                             Conversion& conversion);

}  // namespace crumple::scene_convert
