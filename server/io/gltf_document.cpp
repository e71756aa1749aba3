#include "server/io/gltf_document.h"

#include "common/text.h"
#include "server/io/gltf_check.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"
#include "server/io/side_files.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace crumple::io {
namespace {

constexpr std::int64_t kMaxItems = 15'000'000;  // corners of as many triangles as a surface may have

enum ComponentType { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

int size_of(int component_type) {
  switch (component_type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

template <class T>
T raw(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);  // the format is little-endian, as the machines that we build for
  return value;
}

// Normalised integers: the specification's section 3.11, "f = max(c / 127, -1)".
double component(const unsigned char* at, int type, bool normalised) {
  switch (type) {
    case kByte:
      return normalised ? std::max(raw<std::int8_t>(at) / 127.0, -1.0) : raw<std::int8_t>(at);
    case kUnsignedByte:
      return *at / (normalised ? 255.0 : 1.0);
    case kShort:
      return normalised ? std::max(raw<std::int16_t>(at) / 32767.0, -1.0) : raw<std::int16_t>(at);
    case kUnsignedShort:
      return raw<std::uint16_t>(at) / (normalised ? 65535.0 : 1.0);
    case kUnsignedInt:
      return raw<std::uint32_t>(at);
    default:
      return raw<float>(at);
  }
}

int components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  return type == "MAT4" ? 16 : 0;
}

// Not negative; -1 for anything else.
std::int64_t whole_number(const Json& object, const char* key, std::int64_t missing) {
  const auto at = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || at == object.end()) return missing;
  if (at->is_number_unsigned()) {
    const auto value = at->get<std::uint64_t>();
    return value <= INT64_MAX ? static_cast<std::int64_t>(value) : -1;
  }
  return -1;
}

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

// `n` numbers; false where there is something else.
bool numbers(const Json& list, std::size_t n, double* out) {
  if (!list.is_array() || list.size() != n) return false;
  for (std::size_t k = 0; k < n; ++k) {
    if (!list[k].is_number()) return false;
    out[k] = list[k].get<double>();
    if (!std::isfinite(out[k])) return false;
  }
  return true;
}

}  // namespace

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
  if (auto read = document.read_buffers(gltf_binary(*content), file.parent_path()); !read)
    return std::unexpected(read.error());
  return document;
}

Result<void> GltfDocument::read_buffers(std::string_view binary, const std::filesystem::path& folder) {
  const Json& buffers = list("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string where = text("buffers[", i, "]");
    const std::int64_t length = whole_number(buffers[i], "byteLength", -1);
    if (length < 0) return fault(where + ".byteLength must be a number of bytes");
    Result<std::string> bytes = std::string();
    if (!has(buffers[i], "uri")) {
      bytes = std::string(binary);  // of the first buffer only; others come out too short
      binary = {};
    } else if (!buffers[i]["uri"].is_string()) {
      return fault(where + ".uri is not a string");
    } else if (const auto& uri = buffers[i]["uri"].get_ref<const std::string&>(); uri.starts_with("data:")) {
      const std::size_t comma = uri.find(";base64,");
      bytes = comma == std::string::npos ? invalid("", "is not base64")
                                         : from_base64(std::string_view(uri).substr(comma + 8));
    } else {
      bytes = read_side_file(uri, folder);
    }
    if (!bytes) return fault(text(where, " ", bytes.error().text()));
    if (static_cast<std::int64_t>(bytes->size()) < length)
      return fault(text(where, " has ", bytes->size(), " bytes, must have byteLength = ", length));
    bytes->resize(static_cast<std::size_t>(length));
    buffers_.push_back(std::move(*bytes));
  }
  return {};
}

Result<GltfDocument::View> GltfDocument::view(const Json& object, const std::string& where) const {
  const auto entry_of = entry(object, "bufferView", "bufferViews", where);
  if (!entry_of) return std::unexpected(entry_of.error());
  const Json& view = **entry_of;
  const auto buffer = index(view, "buffer", buffers_.size(), where + ".bufferView");
  if (!buffer) return std::unexpected(buffer.error());
  const std::int64_t offset = whole_number(view, "byteOffset", 0), length = whole_number(view, "byteLength", -1),
                     stride = whole_number(view, "byteStride", 0);
  const auto size = static_cast<std::int64_t>(buffers_[*buffer].size());
  if (offset < 0 || length < 0 || stride < 0 || stride > 252 || offset > size || length > size - offset)
    return fault(text(where, ".bufferView reaches past its buffer of ", size, " bytes"));
  return View{reinterpret_cast<const unsigned char*>(buffers_[*buffer].data()) + offset,
              static_cast<std::size_t>(length), static_cast<std::size_t>(stride)};
}

Result<void> GltfDocument::read_items(const View& view, std::size_t offset, int type, bool normalised,
                                      Eigen::MatrixXd& out, const std::string& where) const {
  const auto rows = static_cast<std::size_t>(out.rows()), count = static_cast<std::size_t>(out.cols());
  const std::size_t component_size = static_cast<std::size_t>(size_of(type)), item = rows * component_size;
  const std::size_t stride = view.stride > 0 ? view.stride : item;
  if (count == 0) return {};
  if (stride < item || offset > view.length || item > view.length - offset ||
      (count - 1) > (view.length - offset - item) / stride)
    return fault(text(where, " has ", count, " items, which reach past its bufferView of ", view.length, " bytes"));
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < rows; ++k) {
      const double value = component(view.data + offset + i * stride + k * component_size, type, normalised);
      if (!std::isfinite(value)) return fault(text(where, " holds a number that is not finite, at item ", i));
      out(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = value;
    }
  return {};
}

Result<void> GltfDocument::apply_sparse(const Json& sparse, int type, bool normalised, Eigen::MatrixXd& out,
                                        const std::string& where) const {
  const std::int64_t count = whole_number(sparse, "count", -1);
  if (count < 0 || count > out.cols()) return fault(text(where, ".sparse.count must be in [0, ", out.cols(), "]"));
  const Json& ids = object_of(sparse, "indices");
  const Json& values = object_of(sparse, "values");
  const int id_type = static_cast<int>(whole_number(ids, "componentType", 0));
  if (id_type != kUnsignedByte && id_type != kUnsignedShort && id_type != kUnsignedInt)
    return fault(where + ".sparse.indices.componentType must be an unsigned integer's");
  Eigen::MatrixXd at(1, count), with(out.rows(), count);
  for (const auto& [part, into, part_type, part_normalised, name] :
       {std::tuple(&ids, &at, id_type, false, ".sparse.indices"),
        std::tuple(&values, &with, type, normalised, ".sparse.values")}) {
    const auto from = view(*part, where + name);
    if (!from) return std::unexpected(from.error());
    const std::int64_t offset = whole_number(*part, "byteOffset", 0);
    if (offset < 0) return fault(where + name + ".byteOffset must not be negative");
    if (auto read =
            read_items(*from, static_cast<std::size_t>(offset), part_type, part_normalised, *into, where + name);
        !read)
      return read;
  }
  for (Eigen::Index k = 0; k < count; ++k) {
    if (at(0, k) >= static_cast<double>(out.cols()))
      return fault(text(where, ".sparse.indices[", k, "] must be below ", out.cols()));
    out.col(static_cast<Eigen::Index>(at(0, k))) = with.col(k);
  }
  return {};
}

Result<Eigen::MatrixXd> GltfDocument::accessor(const Json& object, const char* key, std::initializer_list<int> allowed,
                                               const std::string& from) const {
  const auto entry_of = entry(object, key, "accessors", from);
  if (!entry_of) return std::unexpected(entry_of.error());
  const Json& accessor = **entry_of;
  const std::string where = text("accessors[", object[key].get<std::int64_t>(), "]");
  const std::string type_name =
      has(accessor, "type") && accessor["type"].is_string() ? accessor["type"].get<std::string>() : "";
  const int rows = components_of(type_name);
  if (std::find(allowed.begin(), allowed.end(), rows) == allowed.end())
    return fault(text(where, ".type is \"", type_name, "\", which ", from, ".", key, " cannot be"));
  const int type = static_cast<int>(whole_number(accessor, "componentType", 0));
  if (size_of(type) == 0) return fault(text(where, ".componentType is ", type, ", must be 5120 to 5123, 5125 or 5126"));
  const std::int64_t count = whole_number(accessor, "count", -1), offset = whole_number(accessor, "byteOffset", 0);
  if (count < 0 || count > kMaxItems)
    return fault(text(where, ".count is ", count, ", must be in [0, ", kMaxItems, "]"));
  if (offset < 0) return fault(where + ".byteOffset must not be negative");
  const bool normalised = has(accessor, "normalized") && accessor["normalized"] == true;

  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(0, 0);
  if (has(accessor, "bufferView")) {
    const auto seen = view(accessor, where);
    if (!seen) return std::unexpected(seen.error());
    if (count > static_cast<std::int64_t>(seen->length))
      return fault(text(where, " has ", count, " items, which reach past its bufferView"));
    out.setZero(rows, count);
    if (auto read = read_items(*seen, static_cast<std::size_t>(offset), type, normalised, out, where); !read)
      return std::unexpected(read.error());
  } else {
    out.setZero(rows, count);
  }
  if (has(accessor, "sparse"))
    if (auto read = apply_sparse(accessor["sparse"], type, normalised, out, where); !read)
      return std::unexpected(read.error());
  return out;
}

Eigen::Affine3d GltfDocument::LocalTransform::value() const {
  if (given_as_matrix) return matrix;
  return Eigen::Translation3d(translation) * rotation * Eigen::Scaling(scale);
}

Result<std::vector<GltfDocument::LocalTransform>> GltfDocument::local_transforms() const {
  const Json& nodes = list("nodes");
  std::vector<LocalTransform> out(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto wrong = [&](const char* key, const char* rule) {
      return fault(text("nodes[", i, "].", key, " must be ", rule));
    };
    double m[16];
    if (has(nodes[i], "matrix")) {
      if (!numbers(nodes[i]["matrix"], 16, m)) return wrong("matrix", "16 numbers");
      out[i].matrix.matrix() = Eigen::Map<const Eigen::Matrix4d>(m);  // both column-major
      out[i].matrix.makeAffine();
      out[i].given_as_matrix = true;
    }
    if (has(nodes[i], "translation") && !numbers(nodes[i]["translation"], 3, out[i].translation.data()))
      return wrong("translation", "3 numbers");
    if (has(nodes[i], "scale") && !numbers(nodes[i]["scale"], 3, out[i].scale.data()))
      return wrong("scale", "3 numbers");
    if (has(nodes[i], "rotation")) {
      if (!numbers(nodes[i]["rotation"], 4, m) || !(Eigen::Map<const Eigen::Vector4d>(m).norm() > 1e-6))
        return wrong("rotation", "a quaternion of 4 numbers that are not all 0");
      out[i].rotation = Quat(m[3], m[0], m[1], m[2]).normalized();
    }
  }
  return out;
}

std::vector<int> GltfDocument::parents() const {
  const Json& nodes = list("nodes");
  std::vector<int> parent(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (const Json& child : list_of(nodes[i], "children"))
      parent[child.get<std::size_t>()] = static_cast<int>(i);  // check_gltf saw to the range
  return parent;
}

std::vector<Eigen::Affine3d> GltfDocument::world_transforms(const std::vector<LocalTransform>& local,
                                                            const std::vector<int>& parents) {
  std::vector<Eigen::Affine3d> world(local.size());
  for (std::size_t i = 0; i < local.size(); ++i) {
    world[i] = local[i].value();
    for (int p = parents[i]; p >= 0; p = parents[p]) world[i] = local[p].value() * world[i];
  }
  return world;
}

Result<std::vector<int>> GltfDocument::scene_nodes() const {
  const Json& nodes = list("nodes");
  const Json& scenes = list("scenes");
  std::vector<int> stack, out;
  if (scenes.empty()) {
    const std::vector<int> parent = parents();
    for (std::size_t i = nodes.size(); i-- > 0;)
      if (parent[i] < 0) stack.push_back(static_cast<int>(i));
  } else {
    std::size_t chosen = 0;
    if (has(json_, "scene")) {
      const auto given = index(json_, "scene", scenes.size(), "document");
      if (!given) return std::unexpected(given.error());
      chosen = static_cast<std::size_t>(*given);
    }
    const Json& roots = list_of(scenes[chosen], "nodes");
    std::vector<char> seen(nodes.size(), false);
    for (std::size_t k = roots.size(); k-- > 0;) {
      const std::int64_t root = roots[k].is_number_unsigned() ? roots[k].get<std::int64_t>() : -1;
      if (root < 0 || root >= static_cast<std::int64_t>(nodes.size()) || seen[root])
        return fault(text("scenes[", chosen, "].nodes[", k, "] names no node, or one twice"));
      seen[root] = true;
      stack.push_back(static_cast<int>(root));
    }
  }
  while (!stack.empty()) {
    const int node = stack.back();
    stack.pop_back();
    out.push_back(node);
    if (out.size() > nodes.size()) return fault("has scenes that name a node below another one");
    const Json& children = list_of(nodes[static_cast<std::size_t>(node)], "children");
    for (std::size_t k = children.size(); k-- > 0;) stack.push_back(children[k].get<int>());
  }
  return out;
}

}  // namespace crumple::io
