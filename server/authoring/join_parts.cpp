#include "server/authoring/join_parts.h"

#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace crumple::authoring {
namespace {

using sim::example_based::ExampleSet;

double size_of(const std::vector<Vec3>& points, const std::vector<int>& ids) {
  Eigen::AlignedBox3d box;
  for (const int i : ids) box.extend(points[i]);
  return box.diagonal().norm();
}

// The column of each of `wanted` in `bones`, both ascending; -1: none.
std::vector<int> columns_in(const std::vector<int>& wanted, const std::vector<int>& bones) {
  std::vector<int> out;
  for (const int b : wanted) {
    const auto at = std::ranges::lower_bound(bones, b);
    out.push_back(at != bones.end() && *at == b ? static_cast<int>(at - bones.begin()) : -1);
  }
  return out;
}

void join_bones(PrescoredPart& to, const PrescoredPart& from, const std::vector<int>& fresh) {
  std::vector<int> bones;
  std::ranges::set_union(to.bones, from.bones, std::back_inserter(bones));
  const auto n = to.set.W.rows();
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(n + static_cast<Eigen::Index>(fresh.size()), bones.size());
  const std::vector<int> in_to = columns_in(bones, to.bones), in_from = columns_in(bones, from.bones);
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (in_to[b] >= 0) W.col(b).head(n) = to.set.W.col(in_to[b]);
    if (in_from[b] >= 0) W.col(b).tail(fresh.size()) = from.set.W(fresh, in_from[b]);
  }
  for (std::size_t e = 0; e < to.set.examples.size(); ++e) {
    auto& of_to = to.set.examples[e].bones;
    const auto& of_from = from.set.examples[e].bones;
    std::vector<sim::example_based::BoneTransform> joined;
    for (std::size_t b = 0; b < bones.size(); ++b)
      joined.push_back(in_to[b] >= 0 ? of_to[in_to[b]] : of_from[in_from[b]]);
    of_to = std::move(joined);
  }
  if (!to.set.handles.empty()) {
    std::vector<sim::example_based::Handle> handles;
    for (std::size_t b = 0; b < bones.size(); ++b)
      handles.push_back(in_to[b] >= 0 ? to.set.handles[in_to[b]] : from.set.handles[in_from[b]]);
    to.set.handles = std::move(handles);
  }
  to.set.W = std::move(W);
  to.bones = std::move(bones);
}

void join_surface(sim::SurfaceMesh& to, const sim::SurfaceMesh& from) {
  const int first = static_cast<int>(to.vertices.size());
  to.vertices.insert(to.vertices.end(), from.vertices.begin(), from.vertices.end());
  for (Triangle t : from.triangles) {
    for (int& v : t) v += first;
    to.triangles.push_back(t);
  }
}

void join(PrescoredPart& to, const PrescoredPart& from) {
  constexpr double kSamePlace = 1e-9, kLeastHull = 0.01;  // of the part's size
  const ExampleSet& added = from.set;
  ExampleSet& set = to.set;
  std::vector<int> all(set.mesh.X.size());
  std::iota(all.begin(), all.end(), 0);
  const double size = size_of(set.mesh.X, all);

  const int own = set.vertex_count();
  std::vector<Vec3> points = set.mesh.X;
  points.insert(points.end(), added.mesh.X.begin(), added.mesh.X.end());
  const std::vector<int> same = sim::weld(points, kSamePlace * size);
  std::vector<int> id, fresh;  // of the added vertices; those that are new
  for (int v = 0; v < added.vertex_count(); ++v) {
    if (same[own + v] < own) {
      id.push_back(same[own + v]);
      continue;
    }
    id.push_back(own + static_cast<int>(fresh.size()));
    fresh.push_back(v);
    set.mesh.X.push_back(added.mesh.X[v]);
    if (!set.alpha_scale.empty()) set.alpha_scale.push_back(added.alpha_scale[v]);
    if (!set.beta_scale.empty()) set.beta_scale.push_back(added.beta_scale[v]);
  }
  for (Tet tet : added.mesh.tets) {
    for (int& i : tet) i = id[i];
    set.mesh.tets.push_back(tet);
  }
  set.mesh.fill.insert(set.mesh.fill.end(), added.mesh.fill.begin(), added.mesh.fill.end());
  set.mesh.tags.insert(set.mesh.tags.end(), added.mesh.tags.begin(), added.mesh.tags.end());
  for (std::vector<int> hull : added.convex_parts) {
    if (size_of(added.mesh.X, hull) < kLeastHull * size) continue;  // a crumb that nobody feels
    for (int& v : hull) v = id[v];
    set.convex_parts.push_back(std::move(hull));
  }
  join_bones(to, from, fresh);
  join_surface(set.render, added.render);
  to.volume += from.volume;
}

}  // namespace

PrescoredAsset with_small_parts_joined(PrescoredAsset asset, double least) {
  const int n = static_cast<int>(asset.parts.size());
  std::vector<int> root(n);
  std::iota(root.begin(), root.end(), 0);
  std::vector<double> volume(n);  // of each root's group
  std::vector<char> flat(n);      // all of it
  for (int p = 0; p < n; ++p) {
    volume[p] = asset.parts[p].volume;
    flat[p] = asset.parts[p].set.convex_parts.empty();
  }
  const auto is_small = [&](int p) { return volume[p] < least || flat[p]; };
  std::vector<char> alone(n, 0);  // small, and without a neighbour
  for (;;) {
    int small = -1;
    for (int p = 0; p < n; ++p)
      if (sim::find_root(root, p) == p && !alone[p] && is_small(p) && (small < 0 || volume[p] < volume[small]))
        small = p;
    if (small < 0) break;
    std::map<int, double> area;  // shared with each other group
    for (const PrescoredFace& face : asset.faces) {
      const int a = sim::find_root(root, face.a), b = sim::find_root(root, face.b);
      if (a != b && (a == small || b == small)) area[a == small ? b : a] += face.area;
    }
    const auto most = std::ranges::max_element(area, {}, [](const auto& entry) { return entry.second; });
    if (most == area.end()) {
      alone[small] = 1;
      continue;
    }
    const double sum = volume[small] + volume[most->first];
    const char both_flat = flat[small] && flat[most->first];
    sim::unite(root, small, most->first);
    volume[sim::find_root(root, small)] = sum;
    flat[sim::find_root(root, small)] = both_flat;
  }

  PrescoredAsset out;
  std::vector<int> new_id(n, -1);
  for (int p = 0; p < n; ++p) {
    if (sim::find_root(root, p) != p) continue;
    std::vector<int> members;
    for (int q = p; q < n; ++q)
      if (sim::find_root(root, q) == p) members.push_back(q);
    const int largest = *std::ranges::max_element(members, {}, [&](int q) { return asset.parts[q].volume; });
    PrescoredPart part = std::move(asset.parts[largest]);
    for (const int q : members)
      if (q != largest) join(part, asset.parts[q]);
    for (const int q : members) new_id[q] = static_cast<int>(out.parts.size());
    out.parts.push_back(std::move(part));
  }
  std::map<std::pair<int, int>, PrescoredFace> faces;
  for (const PrescoredFace& face : asset.faces) {
    const int a = new_id[face.a], b = new_id[face.b];
    if (a == b) continue;
    PrescoredFace& sum = faces.try_emplace(std::minmax(a, b)).first->second;
    if (sum.area == 0) sum = {.a = std::min(a, b), .b = std::max(a, b), .normal = Vec3::Zero()};
    sum.area += face.area;
    sum.centroid += face.area * face.centroid;
    sum.normal += (a < b ? 1 : -1) * face.area * face.normal;
  }
  for (auto& [pair, face] : faces) {
    face.centroid /= face.area;
    const double length = face.normal.norm();
    face.normal = length > 1e-9 * face.area ? Vec3(face.normal / length) : Vec3::UnitX();
    out.faces.push_back(face);
  }
  return out;
}

}  // namespace crumple::authoring
