#include "server/io/mesh_import.h"

#include "common/text.h"
#include "server/io/gltf_check.h"
#include "server/io/mesh_file.h"
#include "server/io/off_reader.h"
#include "server/io/ply_reader.h"
#include "server/io/polygon.h"
#include "server/io/side_files.h"

#include <assimp/BaseImporter.h>
#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <sstream>
#include <unordered_map>

namespace crumple::io {
namespace {

// Faces that a scene may place, as many as validate(SurfaceMesh) takes: a small file can name its meshes without end.
constexpr std::size_t kMaxPlacedFaces = 5'000'000;

// Collects triangles; vertices at exactly the same place become one.
class Merger {
 public:
  int vertex(const Vec3& p, const Vec3& colour = Vec3::Ones()) {
    // -0 and 0 are one place.
    const Key key{std::bit_cast<std::uint64_t>(p.x() + 0.0), std::bit_cast<std::uint64_t>(p.y() + 0.0),
                  std::bit_cast<std::uint64_t>(p.z() + 0.0)};
    const auto [at, is_new] = ids_.try_emplace(key, static_cast<int>(out.mesh.vertices.size()));
    if (is_new) {
      out.mesh.vertices.push_back(p);
      out.colours.push_back(Vec3::Zero());
      share_.push_back(0);
    }
    for (int c = 0; c < 3; ++c) out.colours[at->second][c] += std::clamp(colour[c], 0.0, 1.0);  // NaN stays
    ++share_[at->second];
    return at->second;
  }

  // The means, or none.
  void finish_colours() {
    for (std::size_t v = 0; v < share_.size(); ++v) out.colours[v] /= share_[v];
    if (!coloured) out.colours.clear();
  }

  void add(const Triangle& t) {
    const auto& X = out.mesh.vertices;
    const Vec3 area = (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]);
    if (area.squaredNorm() > 0 || !area.allFinite())  // validate() speaks about the latter
      out.mesh.triangles.push_back(t);
    else
      ++out.degenerate_triangles;
  }

  ImportedSurface out;
  bool coloured = false;  // any mesh

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& k) const {
      std::uint64_t h = 0;
      for (const std::uint64_t part : k) h = (h ^ part) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
      return h;
    }
  };
  std::unordered_map<Key, int, Hash> ids_;
  std::vector<int> share_;  // vertices that became this one
};

void add_mesh(const aiMesh& mesh, const aiMatrix4x4& placement, Merger& merger, std::vector<char>& used) {
  std::vector<int> ids(mesh.mNumVertices);
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D p = placement * mesh.mVertices[v];
    const aiColor4D c = mesh.HasVertexColors(0) ? mesh.mColors[0][v] : aiColor4D(1, 1, 1, 1);
    ids[v] = merger.vertex({p.x, p.y, p.z}, {c.r, c.g, c.b});
  }
  merger.coloured |= mesh.HasVertexColors(0);
  used.resize(merger.out.mesh.vertices.size(), false);
  merger.out.merged_vertices += static_cast<int>(mesh.mNumVertices);
  std::vector<Triangle> triangles;
  const bool mirrored = placement.Determinant() < 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices < 3) continue;
    std::vector<int> corners;
    for (unsigned k = 0; k < face.mNumIndices; ++k)
      if (face.mIndices[k] < mesh.mNumVertices) corners.push_back(ids[face.mIndices[k]]);
    if (corners.size() < 3) continue;
    triangles.clear();
    cut_polygon(merger.out.mesh.vertices, std::move(corners), triangles);
    for (Triangle t : triangles) {
      if (mirrored) std::swap(t[1], t[2]);
      for (const int v : t) used[v] = true;
      merger.add(t);
    }
  }
}

void add_mesh(const sim::SurfaceMesh& mesh, const std::vector<Vec3>& colours, Merger& merger, std::vector<char>& used) {
  std::vector<int> ids;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    ids.push_back(merger.vertex(mesh.vertices[v], colours.empty() ? Vec3::Ones() : colours[v]));
  merger.coloured = !colours.empty();
  used.resize(merger.out.mesh.vertices.size(), false);
  merger.out.merged_vertices += static_cast<int>(ids.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const int v : {a, b, c}) used[ids[v]] = true;
    merger.add({ids[a], ids[b], ids[c]});
  }
}

// Depth first, with a stack of our own: a file may nest deeper than the call stack.
Result<void> add_scene(const aiScene& scene, const std::string& name, Merger& merger, std::vector<char>& used) {
  std::size_t placed = 0;
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> stack{{scene.mRootNode, scene.mRootNode->mTransformation}};
  while (!stack.empty()) {
    const auto [node, placement] = stack.back();
    stack.pop_back();
    for (unsigned m = 0; m < node->mNumMeshes; ++m) {
      const aiMesh& mesh = *scene.mMeshes[node->mMeshes[m]];
      if ((placed += mesh.mNumFaces) > kMaxPlacedFaces)
        return invalid(name, text("places its meshes so often that they have more than ", kMaxPlacedFaces, " faces"));
      add_mesh(mesh, placement, merger, used);
    }
    for (unsigned c = node->mNumChildren; c-- > 0;)
      stack.emplace_back(node->mChildren[c], placement * node->mChildren[c]->mTransformation);
  }
  return {};
}

// Vertices that no triangle has (of lines, points, or left over) would be enclosed and drawn for nothing.
void drop_unused(ImportedSurface& surface, const std::vector<char>& used) {
  sim::SurfaceMesh& mesh = surface.mesh;
  std::vector<int> new_id(mesh.vertices.size(), -1);
  int kept = 0;
  for (size_t v = 0; v < mesh.vertices.size(); ++v)
    if (used[v]) {
      mesh.vertices[kept] = mesh.vertices[v];
      if (!surface.colours.empty()) surface.colours[kept] = surface.colours[v];
      new_id[v] = kept++;
    }
  mesh.vertices.resize(kept);
  if (!surface.colours.empty()) surface.colours.resize(kept);
  for (Triangle& t : mesh.triangles)
    for (int& v : t) v = new_id[v];
}

// Assimp guesses a format by content where the ending's reader declines, and some of its readers do not return from
// noise: only those of the ending stay.
void keep_readers_of(Assimp::Importer& importer, const std::string& ending) {
  for (std::size_t k = importer.GetImporterCount(); k-- > 0;) {
    std::istringstream endings(importer.GetImporterInfo(k)->mFileExtensions);
    std::string word;
    bool keeps = false;
    while (endings >> word) keeps = keeps || word == ending;
    if (keeps) continue;
    const std::unique_ptr<Assimp::BaseImporter> unused(importer.GetImporter(k));
    importer.UnregisterLoader(unused.get());
  }
}

Result<void> read_by_assimp(const std::filesystem::path& given, Merger& merger, std::vector<char>& used) {
  const std::string name = given.filename().string();
  // Assimp garbles the names of side files where the path has "..".
  std::error_code failure;
  const std::filesystem::path folder =
      std::filesystem::canonical(given.has_parent_path() ? given.parent_path() : ".", failure);
  const std::filesystem::path file = failure ? given : folder / given.filename();
  if (has_ending(file, {".gltf", ".glb"})) {
    const auto content = read_whole(file, kMaxMeshFileBytes);
    if (!content) return std::unexpected(content.error());
    if (auto sound = check_gltf(*content, name); !sound) return sound;
  }
  Assimp::Importer importer;
  keep_readers_of(importer, small_ending(file).substr(1));
  std::string outside;
  importer.SetIOHandler(new SideFiles(file, outside));  // the importer's from here on
  // No post-processing: Debian's Assimp asserts in its triangulation of noise, which would end the process.
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (!outside.empty())
    return invalid(name, "names the file \"" + outside + "\", must name files in its folder or below it");
  if (scene == nullptr || scene->mRootNode == nullptr || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0)
    return invalid(name, text("cannot be read: ", importer.GetErrorString()));
  return add_scene(*scene, name, merger, used);
}

Result<void> read_by_ourselves(const std::filesystem::path& file, Merger& merger, std::vector<char>& used) {
  const std::string name = file.filename().string();
  const auto content = read_whole(file, kMaxMeshFileBytes);
  if (!content) return std::unexpected(content.error());
  PlyMesh mesh;
  if (has_ending(file, {".ply"})) {
    auto ply = read_ply(*content, name);
    if (!ply) return std::unexpected(ply.error());
    mesh = *std::move(ply);
  } else {
    auto off = read_off(*content, name);
    if (!off) return std::unexpected(off.error());
    mesh.surface = *std::move(off);
  }
  if (mesh.surface.triangles.empty()) return invalid(name, "has no triangle");
  if (auto valid = sim::validate(mesh.surface, name); !valid) return valid;
  add_mesh(mesh.surface, mesh.colours, merger, used);
  return {};
}

}  // namespace

Result<ImportedSurface> import_surface(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  if (!has_ending(file, {".obj", ".gltf", ".glb", ".ply", ".stl", ".off", ".fbx"}))
    return invalid(name, "is not a surface mesh file: its ending must be .obj, .gltf, .glb, .ply, .stl, .off or .fbx");
  if (auto readable = check_file(file, kMaxMeshFileBytes); !readable) return std::unexpected(readable.error());

  Merger merger;
  std::vector<char> used;
  const auto read =
      has_ending(file, {".ply", ".off"}) ? read_by_ourselves(file, merger, used) : read_by_assimp(file, merger, used);
  if (!read) return std::unexpected(read.error());
  ImportedSurface& out = merger.out;
  out.merged_vertices -= static_cast<int>(out.mesh.vertices.size());
  if (out.mesh.triangles.empty()) return invalid(name, "has no triangle");
  merger.finish_colours();
  drop_unused(out, used);
  for (std::size_t v = 0; v < out.colours.size(); ++v)
    if (!out.colours[v].allFinite()) return invalid(text(name, ".colours[", v, "]"), "is not finite");
  if (auto valid = sim::validate(out.mesh, name); !valid) return std::unexpected(valid.error());
  return std::move(out);
}

}  // namespace crumple::io
