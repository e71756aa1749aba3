#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <filesystem>
#include <optional>

namespace crumple::lab::stability {

// Nodes and tets of a level file of the yardstick, such as S09_bunny_hung/L0.json; nothing if it is not there.
std::optional<sim::TetMesh> stored_mesh(const std::filesystem::path& file);

}  // namespace crumple::lab::stability
