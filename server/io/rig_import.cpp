#include "server/io/rig_import.h"

#include "common/text.h"
#include "server/io/gltf_merge.h"
#include "server/io/gltf_morph_keys.h"
#include "server/io/gltf_nodes.h"
#include "server/io/gltf_primitive.h"
#include "server/io/gltf_skin.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"

namespace crumple::io {
namespace {

using authoring::ArtistMesh;

Result<GltfVertices> read_meshes(const GltfDocument& document, const GltfSkins& skins,
                                 const std::vector<Eigen::Affine3d>& world) {
  GltfVertices raw;
  const auto nodes = scene_nodes(document);
  if (!nodes) return std::unexpected(nodes.error());
  for (const int n : *nodes) {
    const Json& node = document.list("nodes")[static_cast<std::size_t>(n)];
    if (!GltfDocument::has(node, "mesh")) continue;
    const std::string where = text("nodes[", n, "]");
    const auto mesh = document.entry(node, "mesh", "meshes", where);
    if (!mesh) return std::unexpected(mesh.error());
    const std::vector<int>* handles = nullptr;
    Eigen::Affine3d placement = world[static_cast<std::size_t>(n)];
    if (GltfDocument::has(node, "skin")) {
      const auto skin = document.index(node, "skin", skins.skins.size(), where);
      if (!skin) return std::unexpected(skin.error());
      placement = skins.skins[static_cast<std::size_t>(*skin)].bind_to_scene;  // a skin's mesh does not follow its node
      handles = &skins.skins[static_cast<std::size_t>(*skin)].handle;
    }
    const Json& primitives = GltfDocument::list_of(**mesh, "primitives");
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const std::string at = text("meshes[", node["mesh"].get<int>(), "].primitives[", p, "]");
      if (auto added = add_primitive(document, **mesh, primitives[p], at, placement, handles, raw); !added)
        return std::unexpected(added.error());
    }
  }
  return raw;
}

Result<ArtistMesh> read_gltf(const std::filesystem::path& file, ScaledJoints scaled) {
  const auto document = GltfDocument::read(file);
  if (!document) return std::unexpected(document.error());
  const auto local = local_transforms(*document);
  if (!local) return std::unexpected(local.error());
  const auto world = world_transforms(*local, node_parents(*document));

  ArtistMesh out;
  const auto skins = read_skins(*document, world, out.warnings);
  if (!skins) return std::unexpected(skins.error());
  const auto raw = read_meshes(*document, *skins, world);
  if (!raw) return std::unexpected(raw.error());
  out.handles = skins->handles;
  out.parents = skins->parents;
  merge_vertices(*raw, static_cast<int>(out.handles.size()), out);
  if (out.surface.triangles.empty()) return document->fault("has no triangle");
  if (auto valid = sim::validate(out.surface, document->name()); !valid) return std::unexpected(valid.error());
  for (const Vec3& p : out.surface.vertices)
    if (p.cwiseAbs().maxCoeff() > 1e6) return document->fault("has a vertex farther than 1e6 m from its origin");

  auto poses = read_poses(*document, *skins, *local, scaled, out.warnings);
  if (!poses) return std::unexpected(poses.error());
  out.poses = *std::move(poses);
  if (auto morphed = add_morphed_copies(*document, out); !morphed) return std::unexpected(morphed.error());
  return out;
}

}  // namespace

Result<ArtistMesh> import_artist_mesh(const std::filesystem::path& file, ScaledJoints scaled) {
  if (has_ending(file, {".gltf", ".glb"})) return read_gltf(file, scaled);
  auto surface = import_surface(file);
  if (!surface) return std::unexpected(surface.error());
  ArtistMesh out;
  out.surface = std::move(surface->mesh);
  out.colours = std::move(surface->colours);
  return out;
}

}  // namespace crumple::io
