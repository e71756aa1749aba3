#include "server/io/tet_builder.h"
#include "server/io/token_reader.h"

#include "common/text.h"

#include <limits>
#include <unordered_map>

namespace crumple::io {
namespace {

constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 4;
constexpr std::int64_t kMaxNodes = 4 * std::int64_t{sim::kMaxTets};
constexpr std::int64_t kMaxElements = 20 * std::int64_t{sim::kMaxTets};  // of any kind
constexpr int kTet4 = 4, kTet10 = 11;

void add_node(TokenReader& in, TetBuilder& out, std::int64_t tag, const Vec3& X) {
  if (in.ok() && !out.add_node(tag, X)) in.fault(text("node ", tag, " is there twice"));
}

Vec3 position(TokenReader& in) {
  const double x = in.number("x"), y = in.number("y"), z = in.number("z");
  return {x, y, z};
}

// A physical group as a tag: 0, none, where it is beyond the range of ints.
int group(std::int64_t tag) {
  return std::abs(tag) <= std::numeric_limits<int>::max() ? static_cast<int>(tag) : 0;
}

// The element's nodes to the end of its line; anything but a four-node tet is passed over.
void read_element_nodes(TokenReader& in, TetBuilder& out, std::int64_t type, int part) {
  if (type == kTet4) {
    std::array<std::int64_t, 4> nodes;
    for (std::int64_t& node : nodes) node = in.integer("node tag", 1, kMost);
    if (in.ok()) out.add_tet(nodes, part);
  } else if (type == kTet10) {
    in.fault("is a tet of ten nodes, must have four (write the mesh at order 1)");
  } else {
    ++out.other_elements;
  }
  in.next_line();
}

// <count>, then <tag> <x> <y> <z>
void read_nodes_2(TokenReader& in, TetBuilder& out) {
  const std::int64_t count = in.integer("number of nodes", 1, kMaxNodes);
  for (std::int64_t n = 0; n < count && in.ok(); ++n) {
    const std::int64_t tag = in.integer("node tag", 1, kMost);
    add_node(in, out, tag, position(in));
  }
}

// <count>, then <tag> <type> <number of tags> <tag> ... <node> ...; the first tag is the physical group
void read_elements_2(TokenReader& in, TetBuilder& out) {
  const std::int64_t count = in.integer("number of elements", 1, kMaxElements);
  for (std::int64_t e = 0; e < count && in.ok(); ++e) {
    in.integer("element tag", 1, kMost);
    const std::int64_t type = in.integer("element type", 1, 1000);
    const std::int64_t tags = in.integer("number of tags", 0, 1000);
    int physical = 0;
    for (std::int64_t k = 0; k < tags && in.ok(); ++k) {
      const std::int64_t tag = in.integer("tag", -kMost, kMost);
      if (k == 0) physical = group(tag);
    }
    read_element_nodes(in, out, type, physical);
  }
}

// <blocks> <nodes> <least tag> <largest tag>, then blocks: <dimension> <entity> <parametric> <nodes>, the tags, the
// positions (with parameters after them where parametric is 1)
void read_nodes_4(TokenReader& in, TetBuilder& out) {
  const std::int64_t blocks = in.integer("number of node blocks", 0, kMaxNodes);
  const std::int64_t total = in.integer("number of nodes", 1, kMaxNodes);
  in.next_line();
  for (std::int64_t b = 0; b < blocks && in.ok(); ++b) {
    in.integer("entity dimension", 0, 3);
    in.integer("entity tag", -kMost, kMost);
    in.integer("parametric", 0, 1);
    const std::int64_t count = in.integer("nodes of a block", 0, total - static_cast<std::int64_t>(out.node_count()));
    std::vector<std::int64_t> tags;
    for (std::int64_t n = 0; n < count && in.ok(); ++n) tags.push_back(in.integer("node tag", 1, kMost));
    for (const std::int64_t tag : tags) {
      if (!in.ok()) break;
      add_node(in, out, tag, position(in));
      in.next_line();
    }
  }
}

using PhysicalGroups = std::unordered_map<std::int64_t, int>;  // of volumes

// <points> <curves> <surfaces> <volumes>, then a line each: <tag> <x y z, or the corners of its box> <number of physical
// groups> <group> ...
void read_entities(TokenReader& in, PhysicalGroups& groups) {
  std::int64_t counts[4];
  for (std::int64_t& count : counts) count = in.integer("number of entities", 0, kMaxElements);
  for (int dimension = 0; dimension < 4; ++dimension)
    for (std::int64_t e = 0; e < counts[dimension] && in.ok(); ++e) {
      const std::int64_t tag = in.integer("entity tag", -kMost, kMost);
      for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) in.number("coordinate of an entity");
      if (in.integer("number of physical groups", 0, kMaxElements) > 0 && dimension == 3)
        groups[tag] = group(in.integer("physical group", -kMost, kMost));
      in.next_line();
    }
}

// <blocks> <elements> <least tag> <largest tag>, then blocks: <dimension> <entity> <type> <elements>, and a line an
// element: <tag> <node> ...
void read_elements_4(TokenReader& in, const PhysicalGroups& groups, TetBuilder& out) {
  const std::int64_t blocks = in.integer("number of element blocks", 0, kMaxElements);
  in.integer("number of elements", 1, kMaxElements);
  in.next_line();
  for (std::int64_t b = 0; b < blocks && in.ok(); ++b) {
    const std::int64_t dimension = in.integer("entity dimension", 0, 3);
    const auto of_entity = groups.find(in.integer("entity tag", -kMost, kMost));
    const int physical = dimension == 3 && of_entity != groups.end() ? of_entity->second : 0;
    const std::int64_t type = in.integer("element type", 1, 1000);
    const std::int64_t count = in.integer("elements of a block", 0, kMaxElements);
    for (std::int64_t e = 0; e < count && in.ok(); ++e) {
      in.integer("element tag", 1, kMost);
      read_element_nodes(in, out, type, physical);
    }
  }
}

Result<int> read_version(TokenReader& in) {
  if (in.word() != "$MeshFormat") return in.fault("must begin with $MeshFormat");
  const double version = in.number("format version");
  const std::int64_t type = in.integer("file type", 0, 1);
  in.next_line();
  if (!in.ok()) return std::unexpected(in.error());
  if (type != 0) return in.fault("is a binary file, must be ASCII");
  if (version >= 2 && version < 3) return 2;
  if (version == 4.1) return 4;
  return in.fault(text("has format ", version, ", must have 2.x or 4.1"));
}

void skip_section(TokenReader& in, std::string_view section) {
  const std::string end = "$End" + std::string(section.substr(1));
  while (in.ok() && in.word() != end) {
  }
}

}  // namespace

Result<ImportedTets> read_gmsh(std::string_view content, const std::string& name) {
  TokenReader in(name, content, '\0');
  const auto version = read_version(in);
  if (!version) return std::unexpected(version.error());
  TetBuilder out;
  PhysicalGroups groups;
  while (in.ok()) {
    const std::string_view section = in.word_or_end();
    if (section.empty()) break;
    if (section.starts_with("$End")) continue;
    if (!section.starts_with('$'))
      return in.fault(text("'", section.substr(0, 40), "' stands where a section must begin"));
    if (section == "$Nodes")
      *version == 2 ? read_nodes_2(in, out) : read_nodes_4(in, out);
    else if (section == "$Elements")
      *version == 2 ? read_elements_2(in, out) : read_elements_4(in, groups, out);
    else if (section == "$Entities" && *version == 4)
      read_entities(in, groups);
    else
      skip_section(in, section);
  }
  if (!in.ok()) return std::unexpected(in.error());
  return out.build(name);
}

}  // namespace crumple::io
