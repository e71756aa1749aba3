#include "server/io/gltf_buffers.h"

#include "common/text.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"
#include "server/io/side_files.h"

#include <cctype>

namespace crumple::io {
namespace {

Result<std::string> from_base64(std::string_view text) {
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  while (text.ends_with('=')) text.remove_suffix(1);
  for (const char c : text) {
    int value = -1;
    if (c >= 'A' && c <= 'Z') value = c - 'A';
    if (c >= 'a' && c <= 'z') value = c - 'a' + 26;
    if (c >= '0' && c <= '9') value = c - '0' + 52;
    if (c == '+' || c == '-') value = 62;
    if (c == '/' || c == '_') value = 63;
    if (value < 0) return invalid("", "is not base64");
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    if ((count += 6) >= 8) out += static_cast<char>(bits >> (count -= 8) & 0xFF);
  }
  return out;
}

// "a%20b" -> "a b"
std::string from_uri(const std::string& uri) {
  const auto digit = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  std::string out;
  for (std::size_t k = 0; k < uri.size(); ++k) {
    if (uri[k] == '%' && k + 2 < uri.size() && digit(uri[k + 1]) && digit(uri[k + 2])) {
      out += static_cast<char>(std::stoi(uri.substr(k + 1, 2), nullptr, 16));
      k += 2;
    } else {
      out += uri[k];
    }
  }
  return out;
}

Result<std::string> read_side_file(const std::string& uri, const std::filesystem::path& folder) {
  const std::string name = from_uri(uri);
  if (!is_inside_name(name) || !lies_inside(folder / name, folder))
    return invalid("", text("names the file \"", name, "\", must name files in its folder or below it"));
  return read_whole(folder / name, kMaxMeshFileBytes);
}

}  // namespace

Result<std::vector<std::string>> gltf_buffers(const GltfDocument& document, std::string_view binary,
                                              const std::filesystem::path& folder) {
  std::vector<std::string> out;
  const Json& buffers = document.list("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string where = text("buffers[", i, "]");
    const std::int64_t length = GltfDocument::whole_number(buffers[i], "byteLength", -1);
    if (length < 0) return document.fault(where + ".byteLength must be a number of bytes");
    Result<std::string> bytes = std::string();
    if (!GltfDocument::has(buffers[i], "uri")) {
      bytes = std::string(binary);  // of the first buffer only; others come out too short
      binary = {};
    } else if (!buffers[i]["uri"].is_string()) {
      return document.fault(where + ".uri is not a string");
    } else if (const auto& uri = buffers[i]["uri"].get_ref<const std::string&>(); uri.starts_with("data:")) {
      const std::size_t comma = uri.find(";base64,");
      bytes = comma == std::string::npos ? invalid("", "is not base64")
                                         : from_base64(std::string_view(uri).substr(comma + 8));
    } else {
      bytes = read_side_file(uri, folder);
    }
    if (!bytes) return document.fault(text(where, " ", bytes.error().text()));
    if (static_cast<std::int64_t>(bytes->size()) < length)
      return document.fault(text(where, " has ", bytes->size(), " bytes, must have byteLength = ", length));
    bytes->resize(static_cast<std::size_t>(length));
    out.push_back(std::move(*bytes));
  }
  return out;
}

}  // namespace crumple::io
