#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace crumple::io {

// A picture as the bytes of a PNG file (ISO/IEC 15948), 8 bits a channel. rgb: width x height x 3, row by row from the
// top.
std::string png_of(std::span<const std::uint8_t> rgb, int width, int height);

}  // namespace crumple::io
