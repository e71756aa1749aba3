#pragma once

#include "common/byte_stream.h"
#include "common/codec_message.h"
#include "common/drawn_pieces.h"

#include <vector>

namespace crumple {

// Where a body's vertices were at the time of its topology, as readers of quantised16 have it, and the pieces they make: what the
// positions of a frame are told from.
struct PositionReference {
  std::uint32_t epoch = 0;  // the body's
  std::vector<Vec3f> X;     // [m]
  DrawnPieces pieces;
};

// Positions of vertices as frame_codec.h's table says. reference: of the body, for a frame; null for a topology. Nothing is written for
// no positions; else there must be as many as in the reference.
void put_positions(ByteWriter& out, const std::vector<Vec3f>& positions, const PositionReference* reference, MessageForm form);

// False: bytes are missing, or a number is not finite. Memory is taken for bytes that are there.
bool get_positions(ByteReader& in, std::uint32_t count, const PositionReference* reference, MessageForm form,
                   std::vector<Vec3f>& positions);

// What quantised16 makes of positions.
std::vector<Vec3f> quantised(const std::vector<Vec3f>& positions);

// As float; 0 for what is not finite or beyond 1e30.
float presentable(double number);

}  // namespace crumple
