#include "server/rig/rig_files.h"

#include "common/text.h"
#include "crumple/v1/rig.pb.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"
#include "server/io/message_json.h"
#include "server/scene_convert/geometry_convert.h"

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

Result<authoring::NamedCage> to_cage(const v1::Cage& cage, const std::string& at, const std::filesystem::path& folder) {
  authoring::NamedCage out{.name = cage.name(), .points = {}};
  if (!cage.file().empty()) {
    if (cage.points_size() > 0 || cage.edges_size() > 0 || cage.triangles_size() > 0)
      return invalid(at + ".file", "is given beside points, edges or triangles, must be alone");
    auto surface = io::import_surface(folder / cage.file());
    if (!surface) return invalid(at + ".file", "cannot be read: " + surface.error().text());
    if (surface->mesh.vertices.size() > static_cast<std::size_t>(sim::example_based::kMaxBones))
      return invalid(at + ".file", text("has ", surface->mesh.vertices.size(),
                                        " points, each a handle, must have at most ", sim::example_based::kMaxBones));
    out.points = std::move(surface->mesh.vertices);
    out.faces = std::move(surface->mesh.triangles);
    return out;
  }
  for (const v1::Vec3& p : cage.points()) out.points.push_back(scene_convert::to_vec3(p));
  if (cage.edges_size() % 2 != 0)
    return invalid(at + ".edges", text("holds ", cage.edges_size(), " ids, must hold 2 an edge"));
  if (cage.triangles_size() % 3 != 0)
    return invalid(at + ".triangles", text("holds ", cage.triangles_size(), " ids, must hold 3 a triangle"));
  for (int k = 0; k < cage.edges_size(); k += 2) out.edges.push_back({cage.edges(k), cage.edges(k + 1)});
  for (int k = 0; k < cage.triangles_size(); k += 3)
    out.faces.push_back({cage.triangles(k), cage.triangles(k + 1), cage.triangles(k + 2)});
  return out;
}

}  // namespace

Result<authoring::GivenHandles> read_handles(const std::filesystem::path& file) {
  const auto list = read<v1::HandleList>(file);
  if (!list) return std::unexpected(list.error());
  const auto located = [&](const Error& error) {
    return std::unexpected(io::with_line(error, list->second, file.filename().string()));
  };
  authoring::GivenHandles out;
  for (const v1::Handle& h : list->first.handles())
    out.points.push_back({h.name(), scene_convert::to_vec3(h.position())});
  for (const v1::Bone& b : list->first.bones())
    out.bones.push_back({b.name(), scene_convert::to_vec3(b.from()), scene_convert::to_vec3(b.to())});
  for (const v1::Cage& c : list->first.cages()) {
    auto cage = to_cage(c, text("cages[", out.cages.size(), "]"), file.parent_path());
    if (!cage) return located(cage.error());
    out.cages.push_back(*std::move(cage));
  }
  if (auto ok = authoring::validate(out); !ok) return located(ok.error());
  return out;
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
