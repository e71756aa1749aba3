#pragma once

#include "common/codec_message.h"
#include "common/error.h"
#include "common/frame.h"
#include "common/frame_reference.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Topologies <-> bytes and frames <-> bytes. Everything is little-endian; every field starts at a multiple of its size
// or of 4, whichever is less, so that a reader may lay typed arrays over the bytes. `pad` fills with zeros to the next
// multiple of 4. Version 2:
//
//   Message     offset  type      field
//               0       u8[4]     'C' 'R' 'F' 'C'
//               4       u8        version = 2
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
//               4       u32       n, number of positions: 0 or that of the body's vertices
//               8       u32       m, number of values
//               12      f32[4]    pose: quaternion x y z w of R_WB
//               28      f32[3]    pose: p_WB [m]
//               40      Positions of n vertices (nothing if n = 0)
//                       Values, m of them (n for each channel, channel after channel): quantised16: u8[m], pad; value = u8 / 255
//                                          float32:     f32[m]
//
//   Topology    0       u32       epoch
//   (content)   4       u32       base: the bodies below replace those of the topology of this epoch, which the reader has;
//                                 0xffffffff: they are all bodies
//               8       u32       part: a topology too long for one message comes in several, one after another; from 0
//               12      u32       number of parts
//               16      u32       number of bodies, then one after another:
//     body      0       u32       id
//               4       u8        model: 0 rigid, 1 fixed, 2 fem, 3 example_based
//               5       u8        deformable: 0 or 1
//               6       u16       number of channels
//               8       f32[3]    colour, linear RGB
//               20      f32       opacity
//               24      u32       n, number of vertices
//               28      u32       m, number of triangles
//               32      u32       epoch since which the body is as it is
//               36      Text name; then a Text for each channel
//                       Positions of n vertices (nothing if n = 0)
//                       Triangles, m of them
//
//   Text                u32       length in bytes; then u8[length] UTF-8; pad
//   Positions   quantised16:      f32[3] lowest corner and f32[3] size of the box around them; u16[3 n]; pad
//                                 coordinate = lowest + size * u16 / 65535
//               float32:          f32[3 n]
//                                 either way vertex after vertex: x0 y0 z0 x1 ...
//               quantised16 in a compressed message: the same box; in a frame, the motion of each piece of the body
//                                 (drawn_pieces.h): f32[4] quaternion x y z w of R and f32[3] t [m]; then instead of
//                                 u16[3 n] the bytes u8[6 n]: for x, then y, then z, n low bytes and n high bytes of
//                                 differences d, as zigzag numbers (0 -1 1 -2 ... -> 0 1 2 3 ...); pad. With g the u16
//                                 of R X + t, where X is the vertex in the topology as received, brought into [0, 65535]:
//                                 u16 = g + e, e = d + the e of the vertex before of the same piece (0 for its first).
//                                 In a topology g is 0 and all vertices are one piece. All modulo 2^16
//   Triangles           u32[3 m]  vertex ids, three a triangle
//               compressed:       u8[12 m]: four planes of bytes, the lowest first, of d modulo 2^32 as zigzag numbers;
//                                 id = f - d with f the lowest id above all before (0 for the first)
//
// Version 1 is read, too. There a topology has no base and no parts (its bodies begin at 4 with their number), a body no epoch (its
// name is at 32), and compressed messages have positions of frames as those of topologies, and triangles as u32.
namespace crumple {

// One message of a topology.
struct TopologyPart {
  std::uint32_t epoch = 0;
  std::optional<std::uint32_t> base;  // nothing: the parts have all bodies
  std::uint32_t part = 0, parts = 1;
  std::vector<BodyTopology> bodies;
};

// A coordinate comes back within half a step of the box, size / 131070, plus float rounding; a value, which must lie
// in [0, 1], within 1/510. Poses come back as floats. Numbers that are not finite, or beyond 1e30, are written as 0.
//
// The bodies that changed after epoch `since`; nothing: all bodies. In one message, or in as many as contents of `max_content`
// bytes need.
std::vector<std::string> encode(const Topology& topology, std::optional<std::uint32_t> since, Codec codec, bool compress,
                                std::size_t max_content = kMaxContentBytes);
// reference: of the frame's epoch. The content must not exceed kMaxContentBytes.
std::string encode(const Frame& frame, const FrameReference& reference, Codec codec, bool compress);

// Nothing if all of a topology's bodies, and its frames with values, can be sent in contents of `max_content` bytes; else what is too
// long, as a sentence.
std::optional<std::string> too_long(const Topology& topology, std::size_t max_content = kMaxContentBytes);

// For bytes from anywhere: an error for anything that the table above does not allow, for bytes missing or left over,
// for numbers that are not finite, triangles that name no vertex, and compressed contents of another length. Takes
// memory in proportion to the content, which a message of k bytes cannot claim to be longer than 32768 k.
Result<TopologyPart> decode_topology_part(std::string_view bytes);
// Also an error: positions that are not of the reference's epoch and bodies.
Result<Frame> decode_frame(std::string_view bytes, const FrameReference& reference);

}  // namespace crumple
