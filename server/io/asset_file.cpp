#include "server/io/asset_file.h"

#include "crumple/v1/asset.pb.h"
#include "server/io/mesh_file.h"
#include "server/io/message_json.h"
#include "server/io/write_file.h"
#include "server/scene_convert/asset_convert.h"
#include "server/sim/limits.h"

#include <boost/crc.hpp>

#include <string_view>

namespace crumple::io {
namespace {

constexpr std::uint64_t kMaxBytes = 512ull << 20;
constexpr std::string_view kMagic = "CRUMPLEA";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = kMagic.size() + 4 + 4 + 8;

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}

std::uint64_t get(std::string_view in, std::size_t at, int bytes) {
  std::uint64_t value = 0;
  for (int i = bytes - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(in[at + static_cast<std::size_t>(i)]);
  return value;
}

std::uint32_t crc32(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

std::string to_binary(const std::string& payload) {
  std::string out(kMagic);
  put(out, kVersion, 4);
  put(out, crc32(payload), 4);
  put(out, payload.size(), 8);
  return out + payload;
}

Result<void> parse_binary(std::string_view bytes, v1::Asset& message) {
  if (bytes.size() < kHeaderBytes) return invalid("", "is cut off within its header");
  const std::uint64_t version = get(bytes, 8, 4), crc = get(bytes, 12, 4), size = get(bytes, 16, 8);
  if (version != kVersion)
    return invalid("", "has format version " + std::to_string(version) + ", must have " + std::to_string(kVersion));
  const std::string_view payload = bytes.substr(kHeaderBytes);
  if (payload.size() != size)
    return invalid(
        "", "holds " + std::to_string(payload.size()) + " bytes after its header, must hold " + std::to_string(size));
  if (crc32(payload) != crc) return invalid("", "is damaged: its checksum does not match");
  if (!message.ParseFromArray(payload.data(), static_cast<int>(payload.size())))
    return invalid("", "is damaged: its content is not an asset");
  return {};
}

Result<Asset> to_asset(const v1::Asset& message) {
  Asset asset{message.name(), {}};
  const auto set = [&](auto&& content) -> Result<Asset> {
    if (!content) return std::unexpected(content.error());
    asset.content = *std::move(content);
    return std::move(asset);
  };
  switch (message.content_case()) {
    case v1::Asset::kTetMesh:
      return set(scene_convert::to_tet_mesh(message.tet_mesh(), "tet_mesh"));
    case v1::Asset::kSurface:
      return set(scene_convert::to_surface_mesh(message.surface(), "surface"));
    case v1::Asset::kExamples:
      return set(scene_convert::to_example_set(message.examples(), "examples"));
    case v1::Asset::CONTENT_NOT_SET:
      break;
  }
  return invalid("", "holds nothing, must hold one of tet_mesh, surface, examples");
}

struct ToMessage {
  v1::Asset& message;
  void operator()(const sim::TetMesh& mesh) { *message.mutable_tet_mesh() = scene_convert::to_message(mesh); }
  void operator()(const sim::SurfaceMesh& mesh) { *message.mutable_surface() = scene_convert::to_message(mesh); }
  void operator()(const sim::example_based::ExampleSet& set) {
    *message.mutable_examples() = scene_convert::to_message(set);
  }
};

// A file's errors end with its name, and in JSON with the line.
std::unexpected<Error> of_file(Error error, const std::filesystem::path& file, std::string_view json) {
  const std::string name = file.filename().string();
  if (!json.empty()) return std::unexpected(with_line(std::move(error), json, name));
  error.message += " (" + name + ")";
  return std::unexpected(std::move(error));
}

}  // namespace

Result<Asset> read_asset(const std::filesystem::path& file) {
  Result<std::string> bytes = read_whole(file, kMaxBytes);
  if (!bytes) return std::unexpected(bytes.error());
  const bool binary = bytes->starts_with(kMagic);
  const std::string_view json = binary ? std::string_view() : std::string_view(*bytes);
  v1::Asset message;
  if (auto parsed = binary ? parse_binary(*bytes, message) : parse_json(json, message); !parsed)
    return of_file(parsed.error(), file, json);
  Result<Asset> asset = to_asset(message);
  if (!asset) return of_file(asset.error(), file, json);
  return asset;
}

Result<void> write_asset(const Asset& asset, const std::filesystem::path& file) {
  if (asset.name.size() > sim::limits::kMaxNameBytes)
    return invalid("name", "has " + std::to_string(asset.name.size()) + " bytes, must have at most 256");
  v1::Asset message;
  message.set_name(asset.name);
  std::visit(ToMessage{message}, asset.content);
  if (file.extension() != ".json") return write_file(file, to_binary(message.SerializeAsString()));
  const Result<std::string> json = print_json(message);
  if (!json) return std::unexpected(json.error());
  return write_file(file, *json);
}

}  // namespace crumple::io
