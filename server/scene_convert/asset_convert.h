#pragma once

#include "common/error.h"
#include "crumple/v1/asset.pb.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <string>

namespace crumple::scene_convert {

// Messages to meshes and sets and back. Errors: arrays whose length is no multiple of 3 or 4, and everything the
// value's own validate() rejects; `field` prefixes the path, which uses the message's names.
Result<sim::TetMesh> to_tet_mesh(const v1::TetMesh& message, const std::string& field);
Result<sim::SurfaceMesh> to_surface_mesh(const v1::SurfaceMesh& message, const std::string& field);
Result<sim::example_based::ExampleSet> to_example_set(const v1::ExampleSet& message, const std::string& field);

// Exact: converting back gives equal values.
v1::TetMesh to_message(const sim::TetMesh& mesh);
v1::SurfaceMesh to_message(const sim::SurfaceMesh& mesh);
// Weights are written sparse where that is shorter.
v1::ExampleSet to_message(const sim::example_based::ExampleSet& set);

// An error of the core with its path in the messages' names: X -> positions, W -> weights, q -> rotation,
// t -> translation, convex_parts[1][3] -> convex_parts[1].vertices[3].
Error in_message_names(Error error);

}  // namespace crumple::scene_convert
