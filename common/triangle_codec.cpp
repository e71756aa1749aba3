#include "common/triangle_codec.h"

#include "common/zigzag.h"

#include <algorithm>

namespace crumple {
namespace {

static_assert(sizeof(Triangle) == 12);

bool in_differences(MessageForm form) { return form.compress && form.version >= 2; }

}  // namespace

void put_triangles(ByteWriter& out, const std::vector<Triangle>& triangles, MessageForm form) {
  if (!in_differences(form)) return out.append(triangles.data(), 12 * triangles.size());
  std::vector<std::uint32_t> differences;
  differences.reserve(3 * triangles.size());
  std::uint32_t fresh = 0;
  for (const Triangle& triangle : triangles) {
    for (const int v : triangle) {
      differences.push_back(fresh - static_cast<std::uint32_t>(v));
      fresh = std::max(fresh, static_cast<std::uint32_t>(v) + 1);
    }
  }
  std::string planes;
  append_planes(planes, differences);
  out.append(planes.data(), planes.size());
}

bool get_triangles(ByteReader& in, std::uint32_t count, std::uint32_t vertices, MessageForm form, std::vector<Triangle>& triangles) {
  const char* data = in.skip(std::uint64_t{12} * count);
  if (!data) return false;
  triangles.resize(count);
  if (!in_differences(form)) {
    if (count > 0) std::memcpy(triangles.data(), data, std::size_t{12} * count);
  } else {
    const auto differences = differences_of<std::uint32_t>(data, 3 * std::size_t{count});
    std::uint32_t fresh = 0;
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const std::uint32_t v = fresh - differences[i];
      if (v >= vertices) return false;
      triangles[i / 3][i % 3] = static_cast<int>(v);
      fresh = std::max(fresh, v + 1);
    }
  }
  return std::all_of(triangles.begin(), triangles.end(), [&](const Triangle& triangle) {
    return std::ranges::all_of(triangle, [&](int v) { return v >= 0 && static_cast<std::uint32_t>(v) < vertices; });
  });
}

}  // namespace crumple
