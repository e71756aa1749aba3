#include "server/io/tet_builder.h"
#include "server/io/token_reader.h"

namespace crumple::io {
namespace {

constexpr std::int64_t kMaxNodes = 4 * std::int64_t{sim::kMaxTets};

// <nodes> <dimension 3> <attributes> <markers>, then a line a node: <id> <x> <y> <z> [attributes] [marker]
Result<std::int64_t> read_nodes(TokenReader& in, TetBuilder& out) {
  const std::int64_t count = in.integer("number of nodes", 1, kMaxNodes);
  in.integer("dimension", 3, 3);
  in.next_line();
  std::int64_t first = 0;
  for (std::int64_t n = 0; n < count && in.ok(); ++n) {
    // The first node says where ids start, each later one must be the next.
    const std::int64_t id = n == 0 ? in.integer("first node's id", 0, 1) : in.integer("node id", first + n, first + n);
    if (n == 0) first = id;
    const double x = in.number("x"), y = in.number("y"), z = in.number("z");
    in.next_line();
    out.add_node(id, {x, y, z});
  }
  if (!in.ok()) return std::unexpected(in.error());
  return first;
}

// <tets> <nodes a tet> <attributes>, then a line a tet: <id> <node> <node> <node> <node> ... [attributes]
Result<void> read_elements(TokenReader& in, std::int64_t first, TetBuilder& out) {
  const std::int64_t count = in.integer("number of tets", 1, sim::kMaxTets);
  in.integer("nodes a tet", 4, 10);
  in.next_line();
  const std::int64_t last = first + static_cast<std::int64_t>(out.node_count()) - 1;
  for (std::int64_t t = 0; t < count && in.ok(); ++t) {
    in.integer("tet id", first + t, first + t);
    std::array<std::int64_t, 4> nodes;
    for (std::int64_t& node : nodes) node = in.integer("node id", first, last);
    in.next_line();
    if (in.ok()) out.add_tet(nodes);
  }
  if (!in.ok()) return std::unexpected(in.error());
  return {};
}

}  // namespace

Result<ImportedTets> read_tetgen(std::string_view node_text, std::string_view ele_text, const std::string& node_name,
                                 const std::string& ele_name) {
  TokenReader nodes(node_name, node_text, '#'), elements(ele_name, ele_text, '#');
  TetBuilder out;
  const auto first = read_nodes(nodes, out);
  if (!first) return std::unexpected(first.error());
  if (auto read = read_elements(elements, *first, out); !read) return std::unexpected(read.error());
  return out.build(ele_name);
}

}  // namespace crumple::io
