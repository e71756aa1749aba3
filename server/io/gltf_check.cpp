#include "server/io/gltf_check.h"

#include "common/text.h"
#include "server/io/side_files.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace crumple::io {
namespace {

constexpr int kMaxJsonLevels = 64;
constexpr int kMaxNodeLevels = 1000;
constexpr std::int64_t kMaxAccessorItems = 50'000'000;

std::uint32_t little_endian_32(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int k = 3; k >= 0; --k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

int nesting(std::string_view json) {
  int level = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t k = 0; k < json.size(); ++k) {
    const char c = json[k];
    if (in_string) {
      if (c == '\\')
        ++k;
      else if (c == '"')
        in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      deepest = std::max(deepest, ++level);
    } else if (c == '}' || c == ']') {
      --level;
    }
  }
  return deepest;
}

// Each node has at most one parent and no way leads back to it.
Result<void> check_nodes(const nlohmann::json& nodes, const std::string& name) {
  if (!nodes.is_array()) return invalid(name, "has nodes that are not a list");
  const std::size_t n = nodes.size();
  std::vector<std::int64_t> parent(n, -1);
  for (std::size_t i = 0; i < n; ++i) {
    if (!nodes[i].is_object()) return invalid(name, text("nodes[", i, "] is not an object"));
    const auto children = nodes[i].find("children");
    if (children == nodes[i].end()) continue;
    if (!children->is_array()) return invalid(name, text("nodes[", i, "].children is not a list"));
    for (const auto& child : *children) {
      const std::int64_t c = child.is_number_integer() ? child.get<std::int64_t>() : -1;
      if (c < 0 || c >= static_cast<std::int64_t>(n))
        return invalid(name, text("nodes[", i, "].children names no node"));
      if (parent[c] >= 0) return invalid(name, text("nodes[", c, "] has two parents"));
      parent[c] = static_cast<std::int64_t>(i);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    int levels = 0;
    for (std::int64_t p = parent[i]; p >= 0; p = parent[p])
      if (++levels > kMaxNodeLevels)
        return invalid(name,
                       text("nodes[", i, "] lies in a loop of nodes, or more than ", kMaxNodeLevels, " levels deep"));
  }
  return {};
}

Result<void> check_accessors(const nlohmann::json& accessors, const std::string& name) {
  if (!accessors.is_array()) return invalid(name, "has accessors that are not a list");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    const auto count = accessors[i].is_object() ? accessors[i].find("count") : accessors[i].end();
    if (!accessors[i].is_object() || count == accessors[i].end() || !count->is_number_integer() ||
        count->get<std::int64_t>() < 0 || count->get<std::int64_t>() > kMaxAccessorItems)
      return invalid(name, text("accessors[", i, "].count must be in [0, ", kMaxAccessorItems, "]"));
  }
  return {};
}

// `list`: buffers or images.
Result<void> check_uris(const nlohmann::json& document, const char* list, const std::string& name) {
  const auto items = document.find(list);
  if (items == document.end()) return {};
  if (!items->is_array()) return invalid(name, text("has ", list, " that are not a list"));
  for (std::size_t i = 0; i < items->size(); ++i) {
    const auto& item = (*items)[i];
    if (!item.is_object() || !item.contains("uri")) continue;
    const std::string uri = item["uri"].is_string() ? item["uri"].get<std::string>() : "";
    if (uri.starts_with("data:")) continue;
    if (!is_inside_name(uri) || uri.find("://") != std::string::npos)
      return invalid(name, text(list, "[", i, "].uri is \"", uri.substr(0, 255),
                                "\", must be a relative path in the file's folder or below it, or data"));
  }
  return {};
}

}  // namespace

// Behind a header of 12 bytes, the first chunk: its length, "JSON", text.
Result<std::string_view> gltf_json(std::string_view content, const std::string& name) {
  if (!content.starts_with("glTF")) return content;
  if (content.size() < 20 || content.substr(16, 4) != "JSON") return invalid(name, "has no JSON chunk");
  const std::size_t length = little_endian_32(content, 12);
  if (length > content.size() - 20)
    return invalid(name, text("has a JSON chunk of ", length, " bytes, but only ", content.size() - 20, " follow"));
  return content.substr(20, length);
}

// Then, at a multiple of 4, the second: its length, "BIN\0", bytes.
std::string_view gltf_binary(std::string_view content) {
  if (!content.starts_with("glTF") || content.size() < 20) return {};
  const std::size_t length = little_endian_32(content, 12);
  if (length > content.size() - 20) return {};
  const std::size_t at = 20 + (length + 3) / 4 * 4;
  if (at > content.size() || content.size() - at < 8 || content.substr(at + 4, 4) != std::string_view("BIN\0", 4))
    return {};
  return content.substr(at + 8, little_endian_32(content, at));
}

Result<void> check_gltf(std::string_view content, const std::string& name) {
  const auto text_of = gltf_json(content, name);
  if (!text_of) return std::unexpected(text_of.error());
  if (const int levels = nesting(*text_of); levels > kMaxJsonLevels)
    return invalid(name, text("has JSON of ", levels, " levels, must have at most ", kMaxJsonLevels));
  const nlohmann::json json = nlohmann::json::parse(*text_of, nullptr, false);
  if (!json.is_object()) return invalid(name, "cannot be read: it is not a JSON document");
  const auto asset = json.find("asset");
  const bool versioned =
      asset != json.end() && asset->is_object() && asset->contains("version") && (*asset)["version"].is_string();
  if (!versioned || !(*asset)["version"].get<std::string>().starts_with("2"))
    return invalid(name, "is not glTF 2: asset.version must begin with 2");
  if (const auto nodes = json.find("nodes"); nodes != json.end())
    if (auto valid = check_nodes(*nodes, name); !valid) return valid;
  for (const char* list : {"buffers", "images"})
    if (auto valid = check_uris(json, list, name); !valid) return valid;
  if (const auto accessors = json.find("accessors"); accessors != json.end()) return check_accessors(*accessors, name);
  return {};
}

}  // namespace crumple::io
