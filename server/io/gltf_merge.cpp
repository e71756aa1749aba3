#include "server/io/gltf_merge.h"

#include <map>
#include <unordered_map>

namespace crumple::io {
namespace {

void append(std::string& key, double value) {
  value += 0.0;  // -0 and 0 are one place
  key.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string place_of(const GltfVertex& v) {
  std::string key;
  for (int k = 0; k < 3; ++k) append(key, v.position[k]);
  for (const auto& [copy, move] : v.moves) {
    append(key, copy);
    for (int k = 0; k < 3; ++k) append(key, move[k]);
  }
  return key;
}

}  // namespace

void merge_vertices(const GltfVertices& raw, int handles, authoring::ArtistMesh& out) {
  std::unordered_map<std::string, int> ids;
  std::vector<int> id_of(raw.vertices.size(), -1), share;
  std::vector<std::map<int, double>> weights;
  for (std::size_t c = 0; c < raw.copies.size(); ++c) out.copies.push_back({raw.copies[c], {}});
  const auto vertex = [&](int from) {
    const GltfVertex& v = raw.vertices[from];
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

}  // namespace crumple::io
