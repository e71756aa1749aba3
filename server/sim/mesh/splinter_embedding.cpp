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
    : rest_(splinters.surface.vertices), twin_(twins(rest_)), vertices_(embed(rest_, mesh)), whole_(splinters.count, 1),
      near_at_rest_(splinters.count, 0), vertex_begin_(splinters.count + 1, 0), near_begin_{0}, link_begin_{0},
      touched_(splinters.count, 0) {
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    vertices_.tet[v] = vertices_.tet[twin_[v]];
    vertices_.weights[v] = vertices_.weights[twin_[v]];
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
    std::vector<int> near = tree.near(box);
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
    near_at_rest_[s] = reach(s, faces);
    settle(s, faces);
  }
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
  for (const int s : some) {
    settle(s, faces);
    touched_[s] = 0;
  }
}

// Leaves in group_ the connected groups of near tets, each under its lowest; returns how many tets the home's has.
int SplinterEmbedding::reach(int splinter, const SharedFaces& faces) {
  const std::span<const int> near(near_.begin() + near_begin_[splinter], near_.begin() + near_begin_[splinter + 1]);
  group_.resize(near.size());
  std::iota(group_.begin(), group_.end(), 0);
  for (int l = link_begin_[splinter]; l < link_begin_[splinter + 1]; ++l)
    if (faces.is_whole(links_[l].face)) unite(group_, links_[l].a, links_[l].b);
  for (int& g : group_) g = find_root(group_, g);
  const auto home = std::ranges::lower_bound(near, home_[splinter]) - near.begin();
  return static_cast<int>(std::ranges::count(group_, group_[home]));
}

void SplinterEmbedding::settle(int splinter, const SharedFaces& faces) {
  const int connected = reach(splinter, faces);
  whole_[splinter] = connected == near_at_rest_[splinter];
  const int first = near_begin_[splinter];
  const std::span<const int> near(near_.begin() + first, near_.begin() + near_begin_[splinter + 1]);
  const auto local = [&](int tet) { return std::ranges::lower_bound(near, tet) - near.begin(); };
  const int home_group = group_[local(home_[splinter])];
  for (int i = vertex_begin_[splinter]; i < vertex_begin_[splinter + 1]; ++i) {
    const int v = vertex_id_[i];
    if (group_[local(vertices_.tet[v])] == home_group) continue;
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (group_[k] != home_group) continue;
      const double distance = squared_distance(near_corners_[first + k], rest_[v]);
      if (distance < least) least = distance, best = k;
    }
    vertices_.tet[v] = near[best];
    vertices_.weights[v] = barycentric(near_corners_[first + best], rest_[v]);
  }
}

}  // namespace crumple::sim
