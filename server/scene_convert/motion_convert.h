#pragma once

#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/conversion.h"
#include "server/sim/scene.h"

#include <string>
#include <vector>

namespace crumple::scene_convert {

std::vector<sim::PoseKey> to_keys(const google::protobuf::RepeatedPtrField<v1::PoseKey>& messages,
                                  const std::string& field, Conversion& conversion);

// Ids, ascending and each once, of the nodes of `mesh` that any of the selections picks.
// Errors: a selection without a rule, an unknown face, a box turned inside out, ids out of range, nothing selected.
std::vector<int> to_nodes(const google::protobuf::RepeatedPtrField<v1::NodeSelection>& messages,
                          const sim::TetMesh& mesh, const std::string& field, Conversion& conversion);

}  // namespace crumple::scene_convert
