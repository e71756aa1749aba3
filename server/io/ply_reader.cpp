#include "server/io/ply_reader.h"

#include "common/text.h"
#include "server/io/polygon.h"
#include "server/io/token_reader.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace crumple::io {
namespace {

struct Number {
  enum class Kind { integer, natural, real } kind;
  int bytes;
};

std::optional<Number> number_type(std::string_view name) {
  using enum Number::Kind;
  constexpr struct {
    std::string_view name;
    Number type;
  } kTypes[] = {{"char", {integer, 1}},  {"int8", {integer, 1}},  {"uchar", {natural, 1}},  {"uint8", {natural, 1}},
                {"short", {integer, 2}}, {"int16", {integer, 2}}, {"ushort", {natural, 2}}, {"uint16", {natural, 2}},
                {"int", {integer, 4}},   {"int32", {integer, 4}}, {"uint", {natural, 4}},   {"uint32", {natural, 4}},
                {"float", {real, 4}},    {"float32", {real, 4}},  {"double", {real, 8}},    {"float64", {real, 8}}};
  for (const auto& t : kTypes)
    if (t.name == name) return t.type;
  return std::nullopt;
}

struct Property {
  std::string name;
  std::optional<Number> length;  // of a list
  Number type;
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

enum class Format { ascii, little, big };

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
};

void read_property(TokenReader& in, Header& header) {
  if (header.elements.empty()) {
    in.fault("is a property of no element");
    return;
  }
  Property p;
  std::string_view type = in.word();
  if (type == "list") {
    const std::string_view length = in.word();
    p.length = number_type(length);
    if (in.ok() && (!p.length || p.length->kind == Number::Kind::real))
      in.fault(text("length of a list is '", length.substr(0, 40), "', must be a whole type"));
    type = in.word();
  }
  const auto number = number_type(type);
  if (in.ok() && !number) in.fault(text("type is '", type.substr(0, 40), "', must be a PLY type"));
  if (number) p.type = *number;
  p.name = in.word();
  header.elements.back().properties.push_back(std::move(p));
}

// Leaves `in` behind the line end_header.
Result<Header> read_header(TokenReader& in) {
  if (in.word() != "ply") return in.fault("must begin with ply");
  Header header;
  while (in.ok()) {
    const std::string_view word = in.word();
    if (word == "end_header") break;
    if (word == "format") {
      const std::string_view format = in.word();
      if (format == "binary_little_endian")
        header.format = Format::little;
      else if (format == "binary_big_endian")
        header.format = Format::big;
      else if (format != "ascii")
        return in.fault(
            text("format is '", format.substr(0, 40), "', must be ascii, binary_little_endian or binary_big_endian"));
      in.next_line();
    } else if (word == "element") {
      Element e;
      e.name = in.word();
      // An item takes a byte at least, which bounds what a short file can make us do.
      e.count = in.integer("number of items", 0, static_cast<std::int64_t>(in.bytes_left()));
      header.elements.push_back(std::move(e));
    } else if (word == "property") {
      read_property(in, header);
    } else {
      in.next_line();  // comment, obj_info
    }
  }
  if (!in.ok()) return std::unexpected(in.error());
  return header;
}

// Where the body's numbers come from.
class Body {
 public:
  Body(TokenReader& in, std::string_view bytes, Format format) : in_(in), bytes_(bytes), format_(format) {}

  double next(const Number& type) { return format_ == Format::ascii ? in_.number("value") : binary(type); }

  std::int64_t next_length(const Number& type) {
    const double length = next(type);
    if (length >= 0 && length <= static_cast<double>(bytes_.size())) return static_cast<std::int64_t>(length);
    in_.fault(text("length of a list is ", length, ", must be in [0, ", bytes_.size(), "]"));
    return 0;
  }

 private:
  template <class T>
  static double as(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return static_cast<double>(value);
  }

  double binary(const Number& type) {
    if (at_ + type.bytes > bytes_.size()) {
      if (in_.ok()) in_.fault("ends too early");
      return 0;
    }
    unsigned char raw[8];
    std::memcpy(raw, bytes_.data() + at_, type.bytes);
    at_ += type.bytes;
    if ((format_ == Format::little) != (std::endian::native == std::endian::little))
      std::reverse(raw, raw + type.bytes);
    if (type.kind == Number::Kind::real) return type.bytes == 4 ? as<float>(raw) : as<double>(raw);
    const bool sign = type.kind == Number::Kind::integer;
    switch (type.bytes) {
      case 1:
        return sign ? as<std::int8_t>(raw) : as<std::uint8_t>(raw);
      case 2:
        return sign ? as<std::int16_t>(raw) : as<std::uint16_t>(raw);
      default:
        return sign ? as<std::int32_t>(raw) : as<std::uint32_t>(raw);
    }
  }

  TokenReader& in_;
  std::string_view bytes_;
  std::size_t at_ = 0;
  Format format_;
};

// What a channel's value is a fraction of.
double full(const Number& type) {
  if (type.kind == Number::Kind::real) return 1;
  return std::ldexp(1.0, 8 * type.bytes - (type.kind == Number::Kind::integer ? 1 : 0)) - 1;
}

bool has_colours(const Element& element) {
  const auto has = [&](const char* name) {
    return std::ranges::any_of(element.properties, [&](const Property& p) { return p.name == name && !p.length; });
  };
  return has("red") && has("green") && has("blue");
}

void read_vertex(Body& body, const Element& element, bool coloured, PlyMesh& out) {
  Vec3 X = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());  // an absent coordinate is no position
  Vec3 colour = Vec3::Zero();
  for (const Property& p : element.properties) {
    if (p.length) {
      for (std::int64_t k = body.next_length(*p.length); k > 0; --k) body.next(p.type);
      continue;
    }
    const double value = body.next(p.type);
    if (p.name == "x") X.x() = value;
    if (p.name == "y") X.y() = value;
    if (p.name == "z") X.z() = value;
    if (p.name == "red") colour[0] = value / full(p.type);
    if (p.name == "green") colour[1] = value / full(p.type);
    if (p.name == "blue") colour[2] = value / full(p.type);
  }
  out.surface.vertices.push_back(X);
  if (coloured) out.colours.push_back(colour);
}

void read_face(TokenReader& in, Body& body, const Element& element, std::vector<std::vector<int>>& out) {
  for (const Property& p : element.properties) {
    if (!p.length) {
      body.next(p.type);
      continue;
    }
    const bool corners = p.name == "vertex_indices" || p.name == "vertex_index";
    std::vector<int> ids;
    for (std::int64_t k = body.next_length(*p.length); k > 0 && in.ok(); --k) {
      const double id = body.next(p.type);
      if (!corners) continue;
      if (!(id >= 0 && id < 1e9))
        in.fault(text("vertex id is ", id, ", must be that of a vertex"));
      else
        ids.push_back(static_cast<int>(id));
    }
    if (ids.size() >= 3 && in.ok()) out.push_back(std::move(ids));
  }
}

void skip_item(Body& body, const Element& element) {
  for (const Property& p : element.properties)
    for (std::int64_t k = p.length ? body.next_length(*p.length) : 1; k > 0; --k) body.next(p.type);
}

}  // namespace

Result<PlyMesh> read_ply(std::string_view content, const std::string& name) {
  TokenReader in(name, content, '\0');
  const auto header = read_header(in);
  if (!header) return std::unexpected(header.error());
  in.rest_of_line();
  const std::size_t behind = content.size() - in.bytes_left();
  Body body(in, content.substr(std::min(behind + 1, content.size())), header->format);
  PlyMesh out;
  std::vector<std::vector<int>> polygons;  // they may come before the vertices
  for (const Element& element : header->elements) {
    const bool coloured = has_colours(element);
    for (std::int64_t k = 0; k < element.count && in.ok(); ++k) {
      if (element.name == "vertex")
        read_vertex(body, element, coloured, out);
      else if (element.name == "face")
        read_face(in, body, element, polygons);
      else
        skip_item(body, element);
    }
  }
  if (!in.ok()) return std::unexpected(in.error());
  for (std::vector<int>& ids : polygons) {
    for (const int id : ids)
      if (id >= static_cast<int>(out.surface.vertices.size()))
        return invalid(name, text("names vertex ", id, ", must be in [0, ", out.surface.vertices.size(), ")"));
    cut_polygon(out.surface.vertices, std::move(ids), out.surface.triangles);
  }
  return out;
}

}  // namespace crumple::io
