#include "server/lab/raster.h"

#include <algorithm>
#include <cmath>

namespace crumple::lab {
namespace {

using Vec2 = Eigen::Vector2d;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

Raster::Raster(int width, int height, const std::array<int, 3>& background)
    : width_(kSamples * width),
      height_(kSamples * height),
      sample_(
          static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_),
          {static_cast<float>(background[0]), static_cast<float>(background[1]), static_cast<float>(background[2])}) {}

void Raster::draw(const std::vector<Patch>& patches, int x, int y, int tile_width, int tile_height) {
  const int x_end = std::min(width_, kSamples * (x + tile_width)),
            y_end = std::min(height_, kSamples * (y + tile_height));
  for (const Patch& patch : patches) {
    std::array<Vec2, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = kSamples * (patch.corners[k] + Vec2(x, y));
    const double area = cross(p[1] - p[0], p[2] - p[0]);
    if (!(std::abs(area) > 0)) continue;
    if (area < 0) std::swap(p[1], p[2]);
    const Vec2 lower = p[0].cwiseMin(p[1]).cwiseMin(p[2]), upper = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    const int first_x = std::clamp(static_cast<int>(std::floor(std::max(lower.x(), 0.0))), kSamples * x, x_end);
    const int first_y = std::clamp(static_cast<int>(std::floor(std::max(lower.y(), 0.0))), kSamples * y, y_end);
    for (int j = first_y; j < y_end && j <= upper.y(); ++j)
      for (int i = first_x; i < x_end && i <= upper.x(); ++i) {
        const Vec2 at(i + 0.5, j + 0.5);
        bool inside = true;
        for (int k = 0; k < 3; ++k) inside = inside && cross(p[(k + 1) % 3] - p[k], at - p[k]) >= 0;
        if (!inside) continue;
        auto& sample =
            sample_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
        for (int c = 0; c < 3; ++c)
          sample[c] += static_cast<float>(patch.opacity) * (static_cast<float>(patch.rgb[c]) - sample[c]);
      }
  }
}

std::vector<std::uint8_t> Raster::rgb() const {
  const int width = width_ / kSamples, height = height_ / kSamples;
  std::vector<std::uint8_t> out;
  out.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int j = 0; j < kSamples; ++j)
          for (int i = 0; i < kSamples; ++i)
            sum += sample_[static_cast<std::size_t>(kSamples * y + j) * static_cast<std::size_t>(width_) +
                           static_cast<std::size_t>(kSamples * x + i)][c];
        out.push_back(static_cast<std::uint8_t>(std::lround(sum / (kSamples * kSamples))));
      }
  return out;
}

}  // namespace crumple::lab
