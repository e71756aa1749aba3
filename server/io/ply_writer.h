#pragma once

#include "common/error.h"
#include "common/types.h"

#include <filesystem>
#include <span>

namespace crumple::io {

// A triangle surface as binary little-endian PLY; vertices in W [m], `values` (one a vertex in [0, 1]) as the property
// `quality`, or empty.
Result<void> write_ply(const std::filesystem::path& file, std::span<const Vec3f> vertices, std::span<const Triangle> triangles,
                       std::span<const float> values = {});

}  // namespace crumple::io
