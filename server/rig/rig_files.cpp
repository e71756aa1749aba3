#include "server/rig/rig_files.h"

#include "common/text.h"
#include "crumple/v1/rig.pb.h"
#include "server/io/mesh_file.h"
#include "server/io/message_json.h"
#include "server/scene_convert/geometry_convert.h"

#include <set>

namespace crumple::rig {
namespace {

constexpr std::uintmax_t kMaxBytes = 64u << 20;

// The message, and the text for lines of errors.
template <class Message>
Result<std::pair<Message, std::string>> read(const std::filesystem::path& file) {
  auto content = io::read_whole(file, kMaxBytes);
  if (!content) return std::unexpected(content.error());
  Message message;
  if (auto parsed = io::parse_json(*content, message); !parsed)
    return std::unexpected(io::with_line(parsed.error(), *content, file.filename().string()));
  return std::pair(std::move(message), *std::move(content));
}

}  // namespace

Result<std::vector<sim::example_based::Handle>> read_handles(const std::filesystem::path& file) {
  const auto list = read<v1::HandleList>(file);
  if (!list) return std::unexpected(list.error());
  const auto fault = [&](const std::string& field, const std::string& message) {
    return std::unexpected(
        io::with_line({ErrorCode::invalid_argument, field, message}, list->second, file.filename().string()));
  };
  std::vector<sim::example_based::Handle> handles;
  std::set<std::string> names;
  for (const v1::Handle& h : list->first.handles()) {
    const std::string at = text("handles[", handles.size(), "]");
    const Vec3 position = scene_convert::to_vec3(h.position());
    if (h.name().empty() || h.name().size() > 256)
      return fault(at + ".name", text("has ", h.name().size(), " bytes, must have 1 to 256"));
    if (!names.insert(h.name()).second) return fault(at + ".name", "is \"" + h.name() + "\", which another handle has");
    if (!position.allFinite() || position.cwiseAbs().maxCoeff() > 1e6)
      return fault(at + ".position", "must be finite and within 1e6 m");
    handles.push_back({h.name(), position});
  }
  if (handles.empty()) return fault("handles", "is empty, must have at least one");
  return handles;
}

Result<std::vector<authoring::NamedPose>> read_poses(const std::filesystem::path& file) {
  const auto list = read<v1::PoseList>(file);
  if (!list) return std::unexpected(list.error());
  std::vector<authoring::NamedPose> poses;
  for (const v1::RigPose& p : list->first.poses()) {
    authoring::NamedPose pose{p.name(), {}};
    for (const v1::HandleMove& m : p.moves()) {
      const std::string at = text("poses[", poses.size(), "].moves[", pose.moves.size(), "]");
      authoring::HandleMove move{.handle = m.handle(), .position = {}, .rotation = {}};
      if (m.has_position()) move.position = scene_convert::to_vec3(m.position());
      if (m.has_rotation()) {
        const auto q = scene_convert::to_rotation(m.rotation(), at + ".rotation");
        if (!q) return std::unexpected(io::with_line(q.error(), list->second, file.filename().string()));
        move.rotation = *q;
      }
      pose.moves.push_back(std::move(move));
    }
    poses.push_back(std::move(pose));
  }
  if (poses.empty())
    return std::unexpected(io::with_line({ErrorCode::invalid_argument, "poses", "is empty, must have at least one"},
                                         list->second, file.filename().string()));
  return poses;
}

}  // namespace crumple::rig
