#include "server/sim/mesh/splinter_embedding.h"

#include "common/text.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_faces.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace crumple::sim {
namespace {

double size_of(std::span<const Vec3> points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  return box.diagonal().norm();
}

// Whether a plane of the tet's faces has all of the points beyond it, by more than `spare` [m].
bool parts_from(const Mat34& x, std::span<const int> vertices, const std::vector<Vec3>& points, double spare) {
  return std::ranges::any_of(kTetFaces, [&](const Triangle& face) {
    const Vec3 a = x.col(face[0]), b = x.col(face[1]), c = x.col(face[2]);
    const Vec3 normal = (b - a).cross(c - a).normalized();
    return std::ranges::all_of(vertices, [&](int v) { return normal.dot(points[v] - a) > spare; });
  });
}

}  // namespace

Result<SplinterEmbedding> SplinterEmbedding::make(const SplinterMesh& splinters, const TetMesh& mesh, const SharedFaces& faces) {
  const TetTree tree(mesh);
  SplinterEmbedding made(splinters, mesh, tree);
  if (auto found = made.find_near(mesh, tree, faces); !found) return std::unexpected(found.error());
  return made;
}

SplinterEmbedding::SplinterEmbedding(const SplinterMesh& splinters, const TetMesh& mesh, const TetTree& tree)
    : rest_(splinters.surface.vertices), twin_(weld(rest_, 1e-9 * size_of(rest_))), home_(splinters.count), vertex_begin_(splinters.count + 1, 0), near_begin_{0}, link_begin_{0}, patches_(splinters.patches),
      corners_(patches_.size()), own_(splinters.count), against_(splinters.count), closed_(patches_.size(), 0),
      touched_(splinters.count, 0) {
  for (int t = 0; t < mesh.tet_count(); ++t) corners_of_tet_.push_back(rest_corners(mesh, t));
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    const bool first = twin_[v] == static_cast<int>(v);
    const int t = first ? tree.nearest(rest_[v]).tet : vertices_.tet[twin_[v]];
    vertices_.tet.push_back(t);
    vertices_.weights.push_back(first ? barycentric(corners_of_tet_[t], rest_[v]) : vertices_.weights[twin_[v]]);
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
}

std::span<const int> SplinterEmbedding::vertices_of(int splinter) const {
  return std::span(vertex_id_).subspan(vertex_begin_[splinter], vertex_begin_[splinter + 1] - vertex_begin_[splinter]);
}

// Of the tets whose boxes meet the splinter's, those that no plane of theirs parts from it: they surround its home without a
// gap where it lies in the mesh. One that reaches out of it may need those in between as well.
Result<void> SplinterEmbedding::find_near(const TetMesh& mesh, const TetTree& tree, const SharedFaces& faces) {
  std::vector<std::vector<std::pair<int, int>>> beyond(mesh.tet_count());  // face, the tet on its other side; of the lower tet
  for (int f = 0; f < faces.count(); ++f) beyond[faces[f].tet[0]].emplace_back(f, faces[f].tet[1]);
  std::vector<std::vector<int>> users(faces.count());
  for (int s = 0; s < static_cast<int>(home_.size()); ++s) {
    const std::span<const int> own = vertices_of(s);
    Eigen::AlignedBox3d box;
    Vec3 centroid = Vec3::Zero();
    for (const int v : own) {
      box.extend(rest_[v]);
      centroid += rest_[v] / static_cast<double>(own.size());
    }
    home_[s] = tree.nearest(centroid).tet;
    std::vector<int> known{home_[s]};
    for (const int v : own) known.push_back(vertices_.tet[v]);
    const double spare = 1e-6 * box.diagonal().norm();  // what lies against it has no tets of its own
    std::vector<int> near = tree.near({box.min() - Vec3::Constant(spare), box.max() + Vec3::Constant(spare)});
    std::erase_if(near, [&](int t) { return parts_from(corners_of_tet_[t], own, rest_, spare); });
    add_near(s, std::move(near), known, beyond, faces);
    const auto is_connected = [&](int t) { return connected_[near_begin_[s] + (std::ranges::lower_bound(near_of(s), t) - near_of(s).begin())]; };
    if (!std::ranges::all_of(known, is_connected)) {
      for (const int t : known)
        for (int k = 0; k < 4; ++k) box.extend(corners_of_tet_[t].col(k));
      drop_last_near(s);
      add_near(s, tree.near(box), known, beyond, faces);
    }
    for (int l = link_begin_[s]; l < link_begin_[s + 1]; ++l) users[links_[l].face].push_back(s);
    if (near_.size() > kMaxNear)
      return invalid("", text("lie in more than ", kMaxNear, " tets, one by one: make them smaller, or fewer tets"));
    move_vertices(s);
  }
  for (int s = 0; s < static_cast<int>(home_.size()); ++s) look_at_patches_of(s);
  user_begin_.push_back(0);
  for (const std::vector<int>& near : users) {
    user_.insert(user_.end(), near.begin(), near.end());
    user_begin_.push_back(static_cast<int>(user_.size()));
  }
  return {};
}

std::span<const int> SplinterEmbedding::near_of(int splinter) const {
  return std::span(near_).subspan(near_begin_[splinter], near_begin_[splinter + 1] - near_begin_[splinter]);
}

void SplinterEmbedding::add_near(int splinter, std::vector<int> near, std::span<const int> known,
                                 const std::vector<std::vector<std::pair<int, int>>>& beyond, const SharedFaces& faces) {
  near.insert(near.end(), known.begin(), known.end());
  std::ranges::sort(near);
  near.erase(std::unique(near.begin(), near.end()), near.end());
  for (std::size_t a = 0; a < near.size(); ++a) {
    for (const auto& [face, other] : beyond[near[a]]) {
      const auto b = std::ranges::lower_bound(near, other);
      if (b != near.end() && *b == other) links_.push_back({face, static_cast<int>(a), static_cast<int>(b - near.begin())});
    }
  }
  link_begin_.push_back(static_cast<int>(links_.size()));
  near_.insert(near_.end(), near.begin(), near.end());
  near_begin_.push_back(static_cast<int>(near_.size()));
  connected_.resize(near_.size());
  find_connected(splinter, faces);
}

void SplinterEmbedding::drop_last_near(int splinter) {
  near_.resize(near_begin_[splinter]);
  links_.resize(link_begin_[splinter]);
  near_begin_.pop_back();
  link_begin_.pop_back();
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
    find_connected(s, faces);
    move_vertices(s);
  }
  for (const int s : some) {
    look_at_patches_of(s);
    touched_[s] = 0;
  }
}

void SplinterEmbedding::find_connected(int splinter, const SharedFaces& faces) {
  const std::span<const int> near = near_of(splinter);
  group_.resize(near.size());
  std::iota(group_.begin(), group_.end(), 0);
  for (int l = link_begin_[splinter]; l < link_begin_[splinter + 1]; ++l)
    if (faces.is_whole(links_[l].face)) unite(group_, links_[l].a, links_[l].b);
  const int home = find_root(group_, static_cast<int>(std::ranges::lower_bound(near, home_[splinter]) - near.begin()));
  for (std::size_t k = 0; k < near.size(); ++k)
    connected_[near_begin_[splinter] + k] = find_root(group_, static_cast<int>(k)) == home;
}

void SplinterEmbedding::move_vertices(int splinter) {
  const std::span<const int> near = near_of(splinter);
  const char* connected = &connected_[near_begin_[splinter]];
  for (const int v : vertices_of(splinter)) {
    if (connected[std::ranges::lower_bound(near, vertices_.tet[v]) - near.begin()]) continue;
    int best = home_[splinter];
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (!connected[k]) continue;
      const double distance = squared_distance(corners_of_tet_[near[k]], rest_[v]);
      if (distance < least) least = distance, best = near[k];
    }
    vertices_.tet[v] = best;
    vertices_.weights[v] = barycentric(corners_of_tet_[best], rest_[v]);
  }
}

void SplinterEmbedding::look_at_patches_of(int splinter) {
  for (const auto* patches : {&own_[splinter], &against_[splinter]})
    for (const int p : *patches) closed_[p] = is_closed(p);
}

bool SplinterEmbedding::is_closed(int patch) const {
  const auto parted = [&](int splinter, int tet) {  // where the splinter has it near at all
    const std::span<const int> near = near_of(splinter);
    const auto at = std::ranges::lower_bound(near, tet);
    return at != near.end() && *at == tet && !connected_[near_begin_[splinter] + (at - near.begin())];
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
