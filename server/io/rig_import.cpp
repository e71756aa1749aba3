#include "server/io/rig_import.h"

#include "common/text.h"
#include "server/io/gltf_document.h"
#include "server/io/gltf_skin.h"
#include "server/io/mesh_file.h"
#include "server/io/mesh_import.h"

#include <cstring>
#include <map>
#include <set>
#include <unordered_map>

namespace crumple::io {
namespace {

using authoring::ArtistMesh;
using sim::example_based::Example;

constexpr std::size_t kMaxPlacedVertices = 5'000'000;  // a small file can name its meshes without end
constexpr std::size_t kMaxCopies = 1000;

using Entries = std::vector<std::pair<int, double>>;  // handle or copy, and its share
using Moves = std::vector<std::pair<int, Vec3>>;      // copy, displacement [m]

struct RawVertex {
  Vec3 position, colour = Vec3::Ones();
  Entries weights;
  Moves moves;
};

struct Raw {
  std::vector<RawVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::string> copies;
  bool coloured = false;

  int copy(const std::string& name) {
    const auto at = std::find(copies.begin(), copies.end(), name);
    if (at != copies.end()) return static_cast<int>(at - copies.begin());
    copies.push_back(name);
    return static_cast<int>(copies.size()) - 1;
  }
};

std::string target_name(const Json& mesh, std::size_t k) {
  const Json& names = GltfDocument::list_of(GltfDocument::object_of(mesh, "extras"), "targetNames");
  if (k < names.size() && names[k].is_string() && !names[k].get_ref<const std::string&>().empty())
    return names[k].get<std::string>();
  return text("morph ", k);
}

// A primitive's vertex attributes, one item a vertex.
class Primitive {
 public:
  Primitive(const GltfDocument& document, const Json& mesh, const Json& primitive, std::string where)
      : document_(document), mesh_(mesh), primitive_(primitive), where_(std::move(where)) {}

  // Adds its vertices, placed, and its triangles.
  Result<void> add_to(Raw& raw, const Eigen::Affine3d& placement, const std::vector<int>* handle_of_joint) {
    const int mode = primitive_.is_object() && primitive_.contains("mode") && primitive_["mode"].is_number_integer()
                         ? primitive_["mode"].get<int>()
                         : 4;
    if (mode < 4 || mode > 6) return {};  // points and lines
    const Json& attributes = GltfDocument::object_of(primitive_, "attributes");
    const auto positions = document_.accessor(attributes, "POSITION", {3}, where_ + ".attributes");
    if (!positions) return std::unexpected(positions.error());
    const std::size_t first = raw.vertices.size();
    const auto count = static_cast<std::size_t>(positions->cols());
    if (first + count > kMaxPlacedVertices)
      return document_.fault(text("places more than ", kMaxPlacedVertices, " vertices"));
    raw.vertices.resize(first + count);
    std::span<RawVertex> own(raw.vertices.data() + first, count);
    for (std::size_t i = 0; i < count; ++i)
      own[i].position = placement * Vec3(positions->col(static_cast<Eigen::Index>(i)));
    if (auto r = read_colours(attributes, own, raw); !r) return r;
    if (handle_of_joint)
      if (auto r = read_weights(attributes, own, *handle_of_joint); !r) return r;
    if (auto r = read_targets(own, raw, placement.linear()); !r) return r;
    return add_triangles(raw, static_cast<int>(first), static_cast<int>(count), mode,
                         placement.linear().determinant() < 0);
  }

 private:
  Result<void> same_count(const Eigen::MatrixXd& items, std::size_t vertices, const std::string& name) const {
    if (static_cast<std::size_t>(items.cols()) == vertices) return {};
    return document_.fault(
        text(where_, " has ", items.cols(), " items of ", name, ", must have ", vertices, ", one a vertex"));
  }

  Result<void> read_colours(const Json& attributes, std::span<RawVertex> own, Raw& raw) const {
    if (!attributes.contains("COLOR_0")) return {};
    const auto colours = document_.accessor(attributes, "COLOR_0", {3, 4}, where_ + ".attributes");
    if (!colours) return std::unexpected(colours.error());
    if (auto same = same_count(*colours, own.size(), "COLOR_0"); !same) return same;
    for (std::size_t i = 0; i < own.size(); ++i)
      own[i].colour = colours->col(static_cast<Eigen::Index>(i)).head<3>().cwiseMax(0).cwiseMin(1);
    raw.coloured = true;
    return {};
  }

  Result<void> read_weights(const Json& attributes, std::span<RawVertex> own,
                            const std::vector<int>& handle_of_joint) const {
    for (int set = 0; attributes.contains(text("JOINTS_", set)); ++set) {
      const std::string joints_key = text("JOINTS_", set), weights_key = text("WEIGHTS_", set);
      const auto joints = document_.accessor(attributes, joints_key.c_str(), {4}, where_ + ".attributes");
      if (!joints) return std::unexpected(joints.error());
      const auto weights = document_.accessor(attributes, weights_key.c_str(), {4}, where_ + ".attributes");
      if (!weights) return std::unexpected(weights.error());
      if (auto same = same_count(*joints, own.size(), joints_key); !same) return same;
      if (auto same = same_count(*weights, own.size(), weights_key); !same) return same;
      for (std::size_t i = 0; i < own.size(); ++i)
        for (int k = 0; k < 4; ++k) {
          const double weight = (*weights)(k, static_cast<Eigen::Index>(i)),
                       joint = (*joints)(k, static_cast<Eigen::Index>(i));
          if (weight == 0) continue;
          if (weight < 0)
            return document_.fault(
                text(where_, ".attributes.", weights_key, " is ", weight, " at vertex ", i, ", must not be negative"));
          if (joint < 0 || joint >= static_cast<double>(handle_of_joint.size()))
            return document_.fault(text(where_, ".attributes.", joints_key, " is ", joint, " at vertex ", i,
                                        ", must be below ", handle_of_joint.size(), ", the skin's joints"));
          own[i].weights.emplace_back(handle_of_joint[static_cast<std::size_t>(joint)], weight);
        }
    }
    return {};
  }

  Result<void> read_targets(std::span<RawVertex> own, Raw& raw, const Mat3& linear) const {
    const Json& targets = GltfDocument::list_of(primitive_, "targets");
    for (std::size_t k = 0; k < targets.size(); ++k) {
      if (!GltfDocument::has(targets[k], "POSITION")) continue;
      const std::string where = text(where_, ".targets[", k, "]");
      const auto deltas = document_.accessor(targets[k], "POSITION", {3}, where);
      if (!deltas) return std::unexpected(deltas.error());
      if (auto same = same_count(*deltas, own.size(), text("targets[", k, "].POSITION")); !same) return same;
      const int copy = raw.copy(target_name(mesh_, k));
      if (raw.copies.size() > kMaxCopies) return document_.fault(text("has more than ", kMaxCopies, " morph targets"));
      for (std::size_t i = 0; i < own.size(); ++i)
        if (const Vec3 delta = deltas->col(static_cast<Eigen::Index>(i)); delta != Vec3::Zero())
          own[i].moves.emplace_back(copy, linear * delta);
    }
    return {};
  }

  Result<void> add_triangles(Raw& raw, int first, int count, int mode, bool mirrored) const {
    std::vector<int> ids;
    if (primitive_.contains("indices")) {
      const auto indices = document_.accessor(primitive_, "indices", {1}, where_);
      if (!indices) return std::unexpected(indices.error());
      for (Eigen::Index k = 0; k < indices->cols(); ++k) {
        if ((*indices)(0, k) < 0 || (*indices)(0, k) >= count)
          return document_.fault(
              text(where_, ".indices[", k, "] is ", (*indices)(0, k), ", must be below ", count, ", its vertices"));
        ids.push_back(first + static_cast<int>((*indices)(0, k)));
      }
    } else {
      for (int i = 0; i < count; ++i) ids.push_back(first + i);
    }
    const auto add = [&](int a, int b, int c) {
      if (mirrored) std::swap(b, c);
      raw.triangles.push_back({a, b, c});
    };
    if (mode == 4)
      for (std::size_t k = 0; k + 2 < ids.size(); k += 3) add(ids[k], ids[k + 1], ids[k + 2]);
    for (std::size_t k = 0; mode == 5 && k + 2 < ids.size(); ++k) add(ids[k], ids[k + 1 + k % 2], ids[k + 2 - k % 2]);
    for (std::size_t k = 1; mode == 6 && k + 1 < ids.size(); ++k) add(ids[k], ids[k + 1], ids[0]);
    return {};
  }

  const GltfDocument& document_;
  const Json& mesh_;
  const Json& primitive_;
  std::string where_;
};

// ---- from vertices as the file has them to those of a surface ---------------------------------------------------

void append(std::string& key, double value) {
  value += 0.0;  // -0 and 0 are one place
  key.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string place_of(const RawVertex& v) {
  std::string key;
  for (int k = 0; k < 3; ++k) append(key, v.position[k]);
  for (const auto& [copy, move] : v.moves) {
    append(key, copy);
    for (int k = 0; k < 3; ++k) append(key, move[k]);
  }
  return key;
}

// Triangles without area go, and vertices that no triangle has; attributes of merged vertices are averaged.
void merge(const Raw& raw, int handles, ArtistMesh& out) {
  std::unordered_map<std::string, int> ids;
  std::vector<int> id_of(raw.vertices.size(), -1), share;
  std::vector<std::map<int, double>> weights;
  for (std::size_t c = 0; c < raw.copies.size(); ++c) out.copies.push_back({raw.copies[c], {}});
  const auto vertex = [&](int from) {
    const RawVertex& v = raw.vertices[from];
    const auto [at, is_new] = ids.try_emplace(place_of(v), static_cast<int>(share.size()));
    const int id = id_of[from] = at->second;
    if (is_new) {
      out.surface.vertices.push_back(v.position);
      for (auto& copy : out.copies) copy.vertices.push_back(v.position);
      for (const auto& [copy, move] : v.moves) out.copies[copy].vertices.back() += move;
      if (raw.coloured) out.colours.push_back(Vec3::Zero());
      weights.emplace_back();
      share.push_back(0);
    }
    ++share[id];
    if (raw.coloured) out.colours[id] += v.colour;
    for (const auto& [handle, weight] : v.weights) weights[id][handle] += weight;
  };
  std::vector<Triangle> kept;
  std::vector<char> used(raw.vertices.size(), false);
  for (const Triangle& t : raw.triangles) {
    const Vec3 &a = raw.vertices[t[0]].position, &b = raw.vertices[t[1]].position, &c = raw.vertices[t[2]].position;
    const Vec3 area = (b - a).cross(c - a);
    if (!(area.squaredNorm() > 0) && area.allFinite()) continue;
    kept.push_back(t);
    for (const int v : t) used[v] = true;
  }
  for (std::size_t v = 0; v < used.size(); ++v)  // in the file's order
    if (used[v]) vertex(static_cast<int>(v));
  for (const auto& [a, b, c] : kept) out.surface.triangles.push_back({id_of[a], id_of[b], id_of[c]});
  for (std::size_t i = 0; i < out.colours.size(); ++i) out.colours[i] /= share[i];

  bool weighted = false;
  for (const auto& row : weights) weighted = weighted || !row.empty();
  if (!weighted) return;
  out.weights.setZero(static_cast<Eigen::Index>(share.size()), handles);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    double sum = 0;
    for (const auto& [handle, weight] : weights[i]) sum += weight;
    for (const auto& [handle, weight] : weights[i]) out.weights(static_cast<Eigen::Index>(i), handle) = weight / sum;
  }
}

// The displacement of the morph weights that an animation keys first.
struct MorphKey {
  std::string animation;
  int mesh;
  std::vector<double> weights;
};

void add_morphed_copies(const GltfDocument& document, const std::vector<MorphKey>& keys, ArtistMesh& out) {
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

Result<Raw> read_meshes(const GltfDocument& document, const GltfSkins& skins,
                        const std::vector<Eigen::Affine3d>& world) {
  Raw raw;
  const auto nodes = document.scene_nodes();
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
      Primitive primitive(document, **mesh, primitives[p],
                          text("meshes[", node["mesh"].get<int>(), "].primitives[", p, "]"));
      if (auto added = primitive.add_to(raw, placement, handles); !added) return std::unexpected(added.error());
    }
  }
  return raw;
}

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

Result<ArtistMesh> read_gltf(const std::filesystem::path& file, ScaledJoints scaled) {
  const auto document = GltfDocument::read(file);
  if (!document) return std::unexpected(document.error());
  const auto local = document->local_transforms();
  if (!local) return std::unexpected(local.error());
  const auto world = GltfDocument::world_transforms(*local, document->parents());

  ArtistMesh out;
  const auto skins = read_skins(*document, world, out.warnings);
  if (!skins) return std::unexpected(skins.error());
  const auto raw = read_meshes(*document, *skins, world);
  if (!raw) return std::unexpected(raw.error());
  out.handles = skins->handles;
  merge(*raw, static_cast<int>(out.handles.size()), out);
  if (out.surface.triangles.empty()) return document->fault("has no triangle");
  if (auto valid = sim::validate(out.surface, document->name()); !valid) return std::unexpected(valid.error());
  for (const Vec3& p : out.surface.vertices)
    if (p.cwiseAbs().maxCoeff() > 1e6) return document->fault("has a vertex farther than 1e6 m from its origin");

  auto poses = read_poses(*document, *skins, *local, scaled, out.warnings);
  if (!poses) return std::unexpected(poses.error());
  out.poses = *std::move(poses);
  const auto keys = read_morph_keys(*document);
  if (!keys) return std::unexpected(keys.error());
  add_morphed_copies(*document, *keys, out);
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
