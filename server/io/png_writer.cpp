#include "server/io/png_writer.h"

#include <zlib.h>

#include <cassert>

namespace crumple::io {
namespace {

void append_big_endian(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xFF);
}

// Length, type, data, and the CRC of the last two.
void append_chunk(std::string& out, std::string type, const std::string& data) {
  append_big_endian(out, static_cast<std::uint32_t>(data.size()));
  type += data;
  out += type;
  append_big_endian(out, static_cast<std::uint32_t>(
                             crc32(0, reinterpret_cast<const Bytef*>(type.data()), static_cast<uInt>(type.size()))));
}

}  // namespace

std::string png_of(std::span<const std::uint8_t> rgb, int width, int height) {
  assert(rgb.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  const std::size_t row = static_cast<std::size_t>(width) * 3;
  std::string lines;
  for (int y = 0; y < height; ++y) {
    lines += '\2';  // filter "up": each byte minus the one above
    for (std::size_t k = 0; k < row; ++k) {
      const std::size_t at = static_cast<std::size_t>(y) * row + k;
      lines += static_cast<char>(rgb[at] - (y > 0 ? rgb[at - row] : 0));
    }
  }
  std::string packed(compressBound(static_cast<uLong>(lines.size())), 0);
  uLongf size = static_cast<uLongf>(packed.size());
  [[maybe_unused]] const int done =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(lines.data()),
                static_cast<uLong>(lines.size()), 9);
  assert(done == Z_OK);  // the buffer is as large as it can need
  packed.resize(size);

  std::string header;
  append_big_endian(header, static_cast<std::uint32_t>(width));
  append_big_endian(header, static_cast<std::uint32_t>(height));
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, red green blue, and the only ways there are
  std::string out = "\x89PNG\r\n\x1a\n";
  append_chunk(out, "IHDR", header);
  append_chunk(out, "IDAT", packed);
  append_chunk(out, "IEND", "");
  return out;
}

}  // namespace crumple::io
