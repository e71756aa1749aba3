#include "server/io/gltf_document.h"

#include "common/text.h"
#include "server/io/gltf_buffers.h"
#include "server/io/gltf_check.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"

#include <cstdint>

namespace crumple::io {

const Json& GltfDocument::list_of(const Json& object, const char* key) {
  static const Json kEmpty = Json::array();
  const auto at = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && at != object.end() && at->is_array() ? *at : kEmpty;
}

const Json& GltfDocument::object_of(const Json& object, const char* key) {
  static const Json kEmpty = Json::object();
  const auto at = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && at != object.end() && at->is_object() ? *at : kEmpty;
}

std::string GltfDocument::name_of(const Json& object, const std::string& otherwise) {
  const auto at = object.is_object() ? object.find("name") : object.end();
  const bool given =
      object.is_object() && at != object.end() && at->is_string() && !at->get_ref<const std::string&>().empty();
  return given ? at->get<std::string>() : otherwise;
}

Result<int> GltfDocument::index(const Json& object, const char* key, std::size_t size, const std::string& where) const {
  const std::int64_t value = whole_number(object, key, -1);
  if (value < 0 || value >= static_cast<std::int64_t>(size))
    return fault(text(where, ".", key, " is ", has(object, key) ? object[key].dump().substr(0, 40) : "missing",
                      ", must be an index below ", size));
  return static_cast<int>(value);
}

Result<const Json*> GltfDocument::entry(const Json& object, const char* key, const char* name,
                                        const std::string& where) const {
  const Json& entries = list(name);
  const Result<int> at = index(object, key, entries.size(), where);
  if (!at) return std::unexpected(at.error());
  return &entries[static_cast<std::size_t>(*at)];
}

std::int64_t GltfDocument::whole_number(const Json& object, const char* key, std::int64_t missing) {
  const auto at = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || at == object.end()) return missing;
  if (at->is_number_unsigned()) {
    const auto value = at->get<std::uint64_t>();
    return value <= INT64_MAX ? static_cast<std::int64_t>(value) : -1;
  }
  return -1;
}

Result<GltfDocument> GltfDocument::read(const std::filesystem::path& file) {
  GltfDocument document;
  document.name_ = file.filename().string();
  const auto content = read_whole(file, kMaxMeshFileBytes);
  if (!content) return std::unexpected(content.error());
  if (auto sound = check_gltf(*content, document.name_); !sound) return std::unexpected(sound.error());
  document.json_ = Json::parse(*gltf_json(*content, document.name_), nullptr, false);
  for (const Json& extension : document.list("extensionsRequired"))
    if (extension == "KHR_draco_mesh_compression" || extension == "EXT_meshopt_compression")
      return document.fault(text("needs ", extension.get<std::string>(), ", must be exported without compression"));
  auto buffers = gltf_buffers(document, gltf_binary(*content), file.parent_path());
  if (!buffers) return std::unexpected(buffers.error());
  document.buffers_ = *std::move(buffers);
  return document;
}

}  // namespace crumple::io
