#pragma once

#include "common/error.h"
#include "server/sim/example_based/example_set.h"
#include "server/sim/mesh/surface_mesh.h"
#include "server/sim/mesh/tet_mesh.h"

#include <filesystem>
#include <string>
#include <variant>

namespace crumple::io {

// What an asset file holds: crumple.v1.Asset, whose schema is proto/crumple/v1/asset.proto.
struct Asset {
  std::string name;
  std::variant<sim::TetMesh, sim::SurfaceMesh, sim::example_based::ExampleSet> content;
};

// Two forms, told apart by the file's first bytes:
//   binary (.crumple-asset)  "CRUMPLEA", then little-endian u32 version (1), u32 CRC-32 of the message, u64 its length,
//                            then the protobuf message and nothing else
//   JSON (.json)             protobuf JSON of the message
// Errors: no file, over 512 MiB, cut off or damaged, another version, and whatever validate() rejects; the path of a
// field starts at the message, such as `examples.weights.dense[3]`.
Result<Asset> read_asset(const std::filesystem::path& file);

// JSON if the name ends in .json, else binary. The file appears whole or not at all.
// Reading it again gives equal values. Errors: a name over 256 bytes, a file that cannot be written.
Result<void> write_asset(const Asset& asset, const std::filesystem::path& file);

}  // namespace crumple::io
