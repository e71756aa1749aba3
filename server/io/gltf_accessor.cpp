// What GltfDocument reads of buffers: views, items, sparse items, accessors.
#include "common/text.h"
#include "server/io/gltf_component.h"
#include "server/io/gltf_document.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace crumple::io {
namespace {

constexpr std::int64_t kMaxItems = 15'000'000;  // corners of as many triangles as a surface may have

}  // namespace

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

}  // namespace crumple::io
