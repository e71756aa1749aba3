#pragma once

#include "server/lab/scene_picture.h"

#include <cstdint>
#include <vector>

namespace crumple::lab {

// A picture of pixels, each the mean of three by three samples.
class Raster {
 public:
  Raster(int width, int height, const std::array<int, 3>& background);

  // Draws in the order given, moved by (x, y) pixels and cut off at the tile's size.
  void draw(const std::vector<Patch>& patches, int x, int y, int tile_width, int tile_height);

  std::vector<std::uint8_t> rgb() const;  // width x height x 3

 private:
  static constexpr int kSamples = 3;

  int width_, height_;                        // of samples
  std::vector<std::array<float, 3>> sample_;  // sRGB in [0, 255]
};

}  // namespace crumple::lab
