#include "server/io/scene_file.h"

#include "server/io/mesh_file.h"
#include "server/io/message_json.h"
#include "server/io/scene_folder.h"
#include "server/scene_convert/scene_convert.h"

#include <algorithm>

namespace crumple::io {
namespace {

constexpr std::uint64_t kMaxBytes = 256ull << 20;

Result<v1::Scene> parse(const std::string& json, const std::filesystem::path& file) {
  v1::Scene message;
  if (auto parsed = parse_json(json, message); !parsed)
    return std::unexpected(with_line(parsed.error(), json, file.filename().string()));
  return message;
}

}  // namespace

Result<v1::Scene> read_scene_message(const std::filesystem::path& file) {
  const Result<std::string> json = read_whole(file, kMaxBytes);
  if (!json) return std::unexpected(json.error());
  return parse(*json, file);
}

Result<LoadedScene> load_scene(const std::filesystem::path& file) {
  const Result<std::string> json = read_whole(file, kMaxBytes);
  if (!json) return std::unexpected(json.error());
  Result<v1::Scene> message = parse(*json, file);
  if (!message) return std::unexpected(message.error());
  if (message->name().empty()) message->set_name(file.stem().string());

  const auto of_file = [&](const Error& error) {
    return std::unexpected(with_line(error, *json, file.filename().string()));
  };
  Result<sim::SceneDescription> scene = scene_convert::to_scene(*message, SceneFolder(file.parent_path()));
  if (!scene) return of_file(scene.error());
  const auto recording = scene_convert::to_recording(message->recording());
  if (!recording) return of_file(recording.error());
  return LoadedScene{*std::move(scene), *recording};
}

std::vector<std::string> scene_names(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code failure;
  std::filesystem::directory_iterator it(folder, failure);
  for (; !failure && it != std::filesystem::directory_iterator(); it.increment(failure)) {
    std::error_code unreadable;
    if (it->path().extension() == ".json" && it->is_regular_file(unreadable))
      names.push_back(it->path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace crumple::io
