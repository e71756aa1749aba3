#include "server/io/off_reader.h"

#include "common/text.h"
#include "server/io/polygon.h"
#include "server/io/token_reader.h"

namespace crumple::io {

Result<sim::SurfaceMesh> read_off(std::string_view content, const std::string& name) {
  TokenReader in(name, content, '#');
  if (const std::string_view kind = in.word(); in.ok() && !kind.ends_with("OFF"))
    return in.fault(text("begins with '", kind.substr(0, 8), "', must begin with OFF"));
  // A vertex and a face take some bytes each, which bounds what a short file can make us do.
  const auto most = static_cast<std::int64_t>(in.bytes_left());
  const std::int64_t vertices = in.integer("number of vertices", 1, most);
  const std::int64_t faces = in.integer("number of faces", 1, most);
  in.next_line();

  sim::SurfaceMesh out;
  for (std::int64_t v = 0; v < vertices && in.ok(); ++v) {
    const double x = in.number("x"), y = in.number("y"), z = in.number("z");
    in.next_line();
    out.vertices.push_back({x, y, z});
  }
  for (std::int64_t f = 0; f < faces && in.ok(); ++f) {
    const std::int64_t corners = in.integer("number of corners", 0, static_cast<std::int64_t>(in.bytes_left()));
    std::vector<int> ids;
    for (std::int64_t k = 0; k < corners && in.ok(); ++k)
      ids.push_back(static_cast<int>(in.integer("vertex id", 0, vertices - 1)));
    in.next_line();
    if (in.ok() && ids.size() >= 3) cut_polygon(out.vertices, std::move(ids), out.triangles);
  }
  if (!in.ok()) return std::unexpected(in.error());
  return out;
}

}  // namespace crumple::io
