#pragma once

#include "common/byte_stream.h"
#include "common/codec_message.h"
#include "common/types.h"

#include <vector>

namespace crumple {

// Vertex ids of triangles as frame_codec.h says: plain, or in a compressed message of version 2 as differences from the lowest id that
// no triangle before has named. Who numbers vertices as triangles first name them writes a 0 for each new one, and small
// numbers for those just named.
void put_triangles(ByteWriter& out, const std::vector<Triangle>& triangles, MessageForm form);

// False: bytes are missing, or a triangle names none of the `vertices`.
bool get_triangles(ByteReader& in, std::uint32_t count, std::uint32_t vertices, MessageForm form, std::vector<Triangle>& triangles);

}  // namespace crumple
