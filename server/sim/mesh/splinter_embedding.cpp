#include "server/sim/mesh/splinter_embedding.h"

#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace crumple::sim {
namespace {

std::vector<int> twins(const std::vector<Vec3>& vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : vertices) box.extend(p);
  const double grain = 1e-9 * box.diagonal().norm();
  std::map<std::array<std::int64_t, 3>, int> first;
  std::vector<int> twin;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    std::array<std::int64_t, 3> key;
    for (int a = 0; a < 3; ++a) key[a] = std::llround((vertices[v][a] - box.min()[a]) / grain);
    twin.push_back(first.try_emplace(key, static_cast<int>(v)).first->second);
  }
  return twin;
}

}  // namespace

SplinterEmbedding::SplinterEmbedding(const SplinterMesh& splinters, const TetMesh& mesh, const SharedFaces& faces)
    : rest_(splinters.surface.vertices), twin_(twins(rest_)), vertices_(embed(rest_, mesh)),
      vertex_begin_(splinters.count + 1, 0), near_begin_{0}, link_begin_{0}, patches_(splinters.patches),
      corners_(patches_.size()), own_(splinters.count), against_(splinters.count), closed_(patches_.size(), 0),
      touched_(splinters.count, 0) {
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    vertices_.tet[v] = vertices_.tet[twin_[v]];
    vertices_.weights[v] = vertices_.weights[twin_[v]];
  }
  tet_at_rest_ = vertices_.tet;
  for (std::size_t t = 0; t < splinters.patch.size(); ++t) {
    if (splinters.patch[t] < 0) continue;
    std::vector<int>& corners = corners_[splinters.patch[t]];
    corners.insert(corners.end(), splinters.surface.triangles[t].begin(), splinters.surface.triangles[t].end());
  }
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    std::ranges::sort(corners_[p]);
    corners_[p].erase(std::unique(corners_[p].begin(), corners_[p].end()), corners_[p].end());
    own_[patches_[p].splinter].push_back(static_cast<int>(p));
    for (const int s : patches_[p].others) against_[s].push_back(static_cast<int>(p));
  }
  for (const int s : splinters.splinter) ++vertex_begin_[s + 1];
  std::partial_sum(vertex_begin_.begin(), vertex_begin_.end(), vertex_begin_.begin());
  vertex_id_.resize(rest_.size());
  std::vector<int> end(vertex_begin_.begin(), vertex_begin_.end() - 1);
  for (std::size_t v = 0; v < rest_.size(); ++v) vertex_id_[end[splinters.splinter[v]]++] = static_cast<int>(v);

  std::vector<std::vector<std::pair<int, int>>> neighbours(mesh.tet_count());  // face, the tet beyond; of the lower tet
  for (int f = 0; f < faces.count(); ++f) neighbours[faces[f].tet[0]].emplace_back(f, faces[f].tet[1]);
  const TetTree tree(mesh);
  std::vector<std::vector<int>> users(faces.count());
  for (int s = 0; s < splinters.count; ++s) {
    const std::span<const int> own(vertex_id_.begin() + vertex_begin_[s], vertex_id_.begin() + vertex_begin_[s + 1]);
    Eigen::AlignedBox3d box;
    Vec3 centroid = Vec3::Zero();
    for (const int v : own) {
      box.extend(rest_[v]);
      centroid += rest_[v] / static_cast<double>(own.size());
    }
    home_.push_back(tree.nearest(centroid).tet);
    const Vec3 spare = Vec3::Constant(1e-6 * box.diagonal().norm());  // so that what lies against it has no tets of its own
    std::vector<int> near = tree.near({box.min() - spare, box.max() + spare});
    near.push_back(home_.back());
    for (const int v : own) near.push_back(vertices_.tet[v]);  // a vertex outside of all tets has one outside of the box
    std::ranges::sort(near);
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (std::size_t a = 0; a < near.size(); ++a) {
      for (const auto& [face, beyond] : neighbours[near[a]]) {
        const auto b = std::ranges::lower_bound(near, beyond);
        if (b == near.end() || *b != beyond) continue;
        links_.push_back({face, static_cast<int>(a), static_cast<int>(b - near.begin())});
        users[face].push_back(s);
      }
      Mat34& x = near_corners_.emplace_back();
      for (int k = 0; k < 4; ++k) x.col(k) = mesh.X[mesh.tets[near[a]][k]];
    }
    link_begin_.push_back(static_cast<int>(links_.size()));
    near_.insert(near_.end(), near.begin(), near.end());
    near_begin_.push_back(static_cast<int>(near_.size()));
    connected_.resize(near_.size());
    settle(s, faces);
  }
  for (int s = 0; s < splinters.count; ++s) look_at_patches_of(s);
  user_begin_.push_back(0);
  for (const std::vector<int>& near : users) {
    user_.insert(user_.end(), near.begin(), near.end());
    user_begin_.push_back(static_cast<int>(user_.size()));
  }
}

void SplinterEmbedding::follow(const SharedFaces& faces, std::span<const int> parted) {
  std::vector<int> some;
  for (const int face : parted) {
    for (int u = user_begin_[face]; u < user_begin_[face + 1]; ++u) {
      if (touched_[user_[u]]) continue;
      touched_[user_[u]] = 1;
      some.push_back(user_[u]);
    }
  }
  for (const int s : some) settle(s, faces);
  for (const int s : some) {
    look_at_patches_of(s);
    touched_[s] = 0;
  }
}

void SplinterEmbedding::settle(int splinter, const SharedFaces& faces) {
  const int first = near_begin_[splinter];
  const std::span<const int> near(near_.begin() + first, near_.begin() + near_begin_[splinter + 1]);
  const auto local = [&](int tet) { return std::ranges::lower_bound(near, tet) - near.begin(); };
  group_.resize(near.size());
  std::iota(group_.begin(), group_.end(), 0);
  for (int l = link_begin_[splinter]; l < link_begin_[splinter + 1]; ++l)
    if (faces.is_whole(links_[l].face)) unite(group_, links_[l].a, links_[l].b);
  const int home = find_root(group_, static_cast<int>(local(home_[splinter])));
  for (std::size_t k = 0; k < near.size(); ++k) connected_[first + k] = find_root(group_, static_cast<int>(k)) == home;

  for (int i = vertex_begin_[splinter]; i < vertex_begin_[splinter + 1]; ++i) {
    const int v = vertex_id_[i];
    if (connected_[first + local(vertices_.tet[v])]) continue;
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (!connected_[first + k]) continue;
      const double distance = squared_distance(near_corners_[first + k], rest_[v]);
      if (distance < least) least = distance, best = k;
    }
    vertices_.tet[v] = near[best];
    vertices_.weights[v] = barycentric(near_corners_[first + best], rest_[v]);
  }
}

void SplinterEmbedding::look_at_patches_of(int splinter) {
  for (const auto* patches : {&own_[splinter], &against_[splinter]})
    for (const int p : *patches) closed_[p] = is_closed(p);
}

bool SplinterEmbedding::is_closed(int patch) const {
  const auto parted = [&](int splinter, int tet) {  // where the splinter has it near at all
    const auto begin = near_.begin() + near_begin_[splinter], end = near_.begin() + near_begin_[splinter + 1];
    const auto at = std::lower_bound(begin, end, tet);
    return at != end && *at == tet && !connected_[at - near_.begin()];
  };
  return std::ranges::all_of(corners_[patch], [&](int v) {
    return vertices_.tet[v] == tet_at_rest_[v] &&
           std::ranges::none_of(patches_[patch].others, [&](int s) { return parted(s, tet_at_rest_[v]); });
  });
}

bool SplinterEmbedding::is_hidden(int patch) const {
  const auto& [own, others] = patches_[patch];
  return closed_[patch] && std::ranges::all_of(against_[own], [&](int p) {
    return closed_[p] || std::ranges::find(others, patches_[p].splinter) == others.end();
  });
}

}  // namespace crumple::sim
