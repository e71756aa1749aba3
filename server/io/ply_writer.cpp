#include "server/io/ply_writer.h"

#include "common/text.h"
#include "server/io/write_file.h"

namespace crumple::io {
namespace {

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

Result<void> write_ply(const std::filesystem::path& file, std::span<const Vec3f> vertices, std::span<const Triangle> triangles,
                       std::span<const float> values) {
  std::string bytes = text("ply\nformat binary_little_endian 1.0\nelement vertex ", vertices.size(),
                           "\nproperty float x\nproperty float y\nproperty float z\n",
                           values.empty() ? "" : "property float quality\n", "element face ", triangles.size(),
                           "\nproperty list uchar int vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) append(bytes, vertices[i][k]);
    if (!values.empty()) append(bytes, values[i]);
  }
  for (const Triangle& triangle : triangles) {
    append(bytes, static_cast<unsigned char>(3));
    for (int v : triangle) append(bytes, static_cast<std::int32_t>(v));
  }
  return write_file(file, bytes);
}

}  // namespace crumple::io
