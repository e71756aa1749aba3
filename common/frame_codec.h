#pragma once

#include "common/error.h"
#include "common/frame.h"

#include <string>
#include <string_view>

// Topology <-> bytes and Frame <-> bytes. Everything is little-endian; every field starts at a multiple of its size
// or of 4, whichever is less, so that a reader may lay typed arrays over the bytes. `pad` fills with zeros to the next
// multiple of 4. Version 1:
//
//   Message     offset  type      field
//               0       u8[4]     'C' 'R' 'F' 'C'
//               4       u8        version = 1
//               5       u8        kind: 1 topology, 2 frame
//               6       u8        codec: 0 quantised16, 1 float32
//               7       u8        compressed: 0 or 1
//               8       u32       length of the content in bytes, before compression; at most kMaxContentBytes
//               12      u32       0
//               16                compressed 0: the content. compressed 1: the content as one zstd frame
//
//   Frame       0       u64       step
//   (content)   8       f64       time [s]
//               16      f64       step_ms
//               24      f64       real_time_factor
//               32      u32       epoch
//               36      u32       number of bodies, then one after another:
//     body      0       u32       id
//               4       u32       n, number of positions
//               8       u32       m, number of values
//               12      f32[4]    pose: quaternion x y z w of R_WB
//               28      f32[3]    pose: p_WB [m]
//               40      Positions of n vertices (nothing if n = 0)
//                       Values, m of them: quantised16: u8[m], pad; value = u8 / 255
//                                          float32:     f32[m]
//
//   Topology    0       u32       epoch
//   (content)   4       u32       number of bodies, then one after another:
//     body      0       u32       id
//               4       u8        model: 0 rigid, 1 fixed, 2 fem, 3 example_based
//               5       u8        deformable: 0 or 1
//               6       u16       number of channels
//               8       f32[3]    colour, linear RGB
//               20      f32       opacity
//               24      u32       n, number of vertices
//               28      u32       m, number of triangles
//               32      Text name; then a Text for each channel
//                       Positions of n vertices (nothing if n = 0)
//                       u32[3 m]  vertex ids, three a triangle
//
//   Text                u32       length in bytes; then u8[length] UTF-8; pad
//   Positions   quantised16:      f32[3] lowest corner and f32[3] size of the box around them; u16[3 n]; pad
//                                 coordinate = lowest + size * u16 / 65535
//               float32:          f32[3 n]
//                                 either way vertex after vertex: x0 y0 z0 x1 ...
//               quantised16 in a compressed message: the same box, then instead of u16[3 n] the bytes u8[6 n]: for x,
//                                 then y, then z, n low bytes and n high bytes of the differences d between each u16
//                                 and the vertex's before (0 before the first), modulo 2^16, as zigzag numbers
//                                 (0 -1 1 -2 ... -> 0 1 2 3 ...); pad
namespace crumple {

enum class Codec : std::uint8_t { quantised16 = 0, float32 = 1 };

inline constexpr std::uint32_t kMaxContentBytes = 1u << 28;

// A coordinate comes back within half a step of the box, size / 131070, plus float rounding; a value, which must lie
// in [0, 1], within 1/510. Poses come back as floats. Numbers that are not finite, or beyond 1e30,
// are written as 0. The content must not exceed kMaxContentBytes.
std::string encode(const Topology& topology, Codec codec, bool compress);
std::string encode(const Frame& frame, Codec codec, bool compress);

// For bytes from anywhere: an error for anything that the table above does not allow, for bytes missing or left over,
// for numbers that are not finite, triangles that name no vertex, and compressed contents of another length. Takes
// memory in proportion to the content, which a message of k bytes cannot claim to be longer than 32768 k.
Result<Topology> decode_topology(std::string_view bytes);
Result<Frame> decode_frame(std::string_view bytes);

}  // namespace crumple
