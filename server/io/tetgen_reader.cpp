#include "server/io/tet_builder.h"
#include "server/io/token_reader.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

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

// The number at the given place of the rest of a line.
std::optional<double> number_at(std::string_view line, std::int64_t place) {
  for (std::int64_t k = 0;; ++k) {
    const std::size_t begin = line.find_first_not_of(" \t\r,+");
    if (begin == std::string_view::npos) return std::nullopt;
    line.remove_prefix(begin);
    const std::size_t length = std::min(line.find_first_of(" \t\r,"), line.size());
    double value = 0;
    if (k == place) {
      const auto [end, problem] = std::from_chars(line.data(), line.data() + length, value);
      if (problem != std::errc{} || end != line.data() + length) return std::nullopt;
      return value;
    }
    line.remove_prefix(length);
  }
}

// An attribute as a tag, if it is one.
std::optional<int> whole(std::optional<double> value) {
  if (!value || *value != std::floor(*value) || std::abs(*value) > std::numeric_limits<int>::max()) return std::nullopt;
  return static_cast<int>(*value);
}

// <tets> <nodes a tet> <attributes>, then a line a tet: <id> <node> <node> <node> <node> ... [attributes]
Result<void> read_elements(TokenReader& in, std::int64_t first, TetBuilder& out) {
  const std::int64_t count = in.integer("number of tets", 1, sim::kMaxTets);
  const std::int64_t corners = in.integer("nodes a tet", 4, 10);
  bool tagged = number_at(in.rest_of_line(), 0).value_or(0) > 0;
  in.next_line();
  const std::int64_t last = first + static_cast<std::int64_t>(out.node_count()) - 1;
  for (std::int64_t t = 0; t < count && in.ok(); ++t) {
    in.integer("tet id", first + t, first + t);
    std::array<std::int64_t, 4> nodes;
    for (std::int64_t& node : nodes) node = in.integer("node id", first, last);
    const std::optional<int> tag = tagged ? whole(number_at(in.rest_of_line(), corners - 4)) : 0;
    tagged = tagged && tag;
    in.next_line();
    if (in.ok()) out.add_tet(nodes, tag.value_or(0));
  }
  if (!in.ok()) return std::unexpected(in.error());
  if (!tagged) out.forget_parts();
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
