#include "server/io/tet_builder.h"
#include "server/io/token_reader.h"

#include "common/text.h"

#include <charconv>
#include <map>
#include <optional>
#include <utility>

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

using Sets = std::map<std::string, std::vector<std::int64_t>, std::less<>>;

// <name>, then ids up to the next section, whose name is returned.
std::string_view read_set(TokenReader& in, Sets& sets) {
  std::vector<std::int64_t>& set = sets[std::string(in.word())];
  for (;;) {
    const std::string_view word = in.word_or_end();
    if (word.empty() || word.starts_with('*')) return word;
    std::int64_t id = 0;
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (problem != std::errc{} || end != word.data() + word.size()) {
      in.fault(text("'", word.substr(0, 40), "' stands in a set, must be an id"));
      return {};
    }
    set.push_back(id);
  }
}

// regions: names of sets. allElements is the set of all.
Result<void> number_regions(const std::vector<std::string>& regions, const Sets& sets, std::int64_t first,
                            const std::string& name, TetBuilder& out) {
  const auto count = static_cast<std::int64_t>(out.tet_count());
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const int part = static_cast<int>(r) + 1;
    const auto set = sets.find(regions[r]);
    if (set == sets.end() && regions[r] != "allElements") continue;
    if (set == sets.end())
      for (std::int64_t t = 0; t < count; ++t) out.set_part(static_cast<std::size_t>(t), part);
    else
      for (const std::int64_t id : set->second) {
        if (id < first || id >= first + count)
          return invalid(text(name, ", set ", regions[r].substr(0, 40)),
                         text("names element ", id, ", must be in [", first, ", ", first + count - 1, "]"));
        out.set_part(static_cast<std::size_t>(id - first), part);
      }
  }
  return {};
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
  Sets sets;
  std::vector<std::string> regions;
  std::string_view next;  // the name of a section that has been read already
  while (in.ok()) {
    const std::string_view word = next.empty() ? in.word_or_end() : std::exchange(next, {});
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
    } else if (word == "*SET") {
      next = read_set(in, sets);
    } else if (word == "*REGION") {
      regions.emplace_back(in.word());
      in.next_line();
    } else {
      in.next_line();  // *MATERIAL and its lines
    }
  }
  if (!in.ok()) return std::unexpected(in.error());
  if (!first) return invalid(name, "has no *VERTICES section");
  if (auto numbered = number_regions(regions, sets, *first, name, out); !numbered)
    return std::unexpected(numbered.error());
  return out.build(name);
}

}  // namespace crumple::io
