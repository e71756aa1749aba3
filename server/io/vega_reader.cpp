#include "server/io/tet_builder.h"
#include "server/io/token_reader.h"

#include "common/text.h"

#include <optional>

namespace crumple::io {
namespace {

constexpr std::int64_t kMaxNodes = 4 * std::int64_t{sim::kMaxTets};

// <count> 3 0 0, then <id> <x> <y> <z>; ids start at 0 or 1 and run on.
std::int64_t read_vertices(TokenReader& in, TetBuilder& out) {
  const std::int64_t count = in.integer("number of vertices", 1, kMaxNodes);
  in.integer("dimension", 3, 3);
  in.next_line();
  std::int64_t first = 0;
  for (std::int64_t n = 0; n < count && in.ok(); ++n) {
    const std::int64_t id =
        n == 0 ? in.integer("first vertex's id", 0, 1) : in.integer("vertex id", first + n, first + n);
    if (n == 0) first = id;
    const double x = in.number("x"), y = in.number("y"), z = in.number("z");
    in.next_line();
    out.add_node(id, {x, y, z});
  }
  return first;
}

// TETS, <count> 4 0, then <id> <node> <node> <node> <node>
void read_elements(TokenReader& in, std::int64_t first, TetBuilder& out) {
  if (const std::string_view kind = in.word(); in.ok() && kind != "TETS" && kind != "TET") {
    in.fault(text("elements are '", kind.substr(0, 40), "', must be TETS"));
    return;
  }
  const std::int64_t count = in.integer("number of elements", 1, sim::kMaxTets);
  in.integer("vertices an element", 4, 4);
  in.next_line();
  const std::int64_t last = first + static_cast<std::int64_t>(out.node_count()) - 1;
  for (std::int64_t t = 0; t < count && in.ok(); ++t) {
    in.integer("element id", first + t, first + t);
    std::array<std::int64_t, 4> nodes;
    for (std::int64_t& node : nodes) node = in.integer("vertex id", first, last);
    if (in.ok()) out.add_tet(nodes);
  }
}

}  // namespace

Result<ImportedTets> read_vega(std::string_view content, const std::string& name) {
  TokenReader in(name, content, '#');
  TetBuilder out;
  std::optional<std::int64_t> first;
  while (in.ok()) {
    const std::string_view word = in.word_or_end();
    if (word.empty()) break;
    if (word == "*VERTICES") {
      if (first) return in.fault("has a second *VERTICES section");
      first = read_vertices(in, out);
    } else if (word == "*ELEMENTS") {
      if (!first) return in.fault("has *ELEMENTS before *VERTICES");
      if (out.tet_count() > 0) return in.fault("has a second *ELEMENTS section");
      read_elements(in, *first, out);
    } else if (word == "*INCLUDE") {
      return in.fault("includes another file, which is not supported");
    } else {
      in.next_line();  // *MATERIAL, *REGION, *SET and their lines
    }
  }
  if (!in.ok()) return std::unexpected(in.error());
  if (!first) return invalid(name, "has no *VERTICES section");
  return out.build(name);
}

}  // namespace crumple::io
