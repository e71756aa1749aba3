#include "server/io/gltf_morph_keys.h"

#include "common/text.h"
#include "server/io/gltf_primitive.h"
#include "server/io/gltf_skin.h"

#include <map>

namespace crumple::io {
namespace {

using authoring::ArtistMesh;

// The displacement of the morph weights that an animation keys first.
struct MorphKey {
  std::string animation;
  int mesh;
  std::vector<double> weights;
};

Result<std::vector<MorphKey>> read_morph_keys(const GltfDocument& document) {
  std::vector<MorphKey> keys;
  const Json& animations = document.list("animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const Json& channels = GltfDocument::list_of(animations[a], "channels");
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Json& target = GltfDocument::object_of(channels[c], "target");
      if (!target.contains("path") || target["path"] != "weights" || !target.contains("node")) continue;
      const std::string where = text("animations[", a, "].channels[", c, "]");
      const auto node = document.entry(target, "node", "nodes", where + ".target");
      if (!node) return std::unexpected(node.error());
      const Json& meshes = document.list("meshes");
      const auto mesh = document.index(**node, "mesh", meshes.size(), text("nodes[", target["node"].get<int>(), "]"));
      if (!mesh) return std::unexpected(mesh.error());
      const Json& primitives = GltfDocument::list_of(meshes[static_cast<std::size_t>(*mesh)], "primitives");
      const std::size_t targets = primitives.empty() ? 0 : GltfDocument::list_of(primitives[0], "targets").size();
      const auto values = first_key(document, animations[a], channels[c], where, 1, static_cast<int>(targets));
      if (!values) return std::unexpected(values.error());
      keys.push_back({GltfDocument::name_of(animations[a], text("animation ", a)),
                      *mesh,
                      {values->data(), values->data() + values->size()}});
    }
  }
  return keys;
}

void add_copies(const GltfDocument& document, const std::vector<MorphKey>& keys, ArtistMesh& out) {
  std::map<std::string, std::map<std::string, double>> blend;  // animation -> morph target -> weight
  std::vector<std::string> order;
  for (const MorphKey& key : keys)
    for (std::size_t k = 0; k < key.weights.size(); ++k) {
      if (key.weights[k] == 0) continue;
      if (!blend.contains(key.animation)) order.push_back(key.animation);
      blend[key.animation][target_name(document.list("meshes")[static_cast<std::size_t>(key.mesh)], k)] =
          key.weights[k];
    }
  const std::size_t targets = out.copies.size();
  for (const std::string& animation : order) {
    authoring::DeformedShape copy{animation, out.surface.vertices};
    for (std::size_t t = 0; t < targets; ++t) {
      const auto at = blend[animation].find(out.copies[t].name);
      if (at == blend[animation].end()) continue;
      for (std::size_t i = 0; i < copy.vertices.size(); ++i)
        copy.vertices[i] += at->second * (out.copies[t].vertices[i] - out.surface.vertices[i]);
    }
    out.copies.push_back(std::move(copy));
  }
}

}  // namespace

Result<void> add_morphed_copies(const GltfDocument& document, ArtistMesh& mesh) {
  const auto keys = read_morph_keys(document);
  if (!keys) return std::unexpected(keys.error());
  add_copies(document, *keys, mesh);
  return {};
}

}  // namespace crumple::io
