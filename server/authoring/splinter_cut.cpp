#include "server/authoring/splinter_cut.h"

#include "common/text.h"
#include "server/authoring/polygon_triangles.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <span>

namespace crumple::authoring {
namespace {

constexpr int kOutside = Polyhedron::kOutside;
constexpr double kLeastVolume = 1e-9;  // of a piece, over its length cubed: what is less is rounding
constexpr std::size_t kMostTriangles = 2'000'000;
constexpr std::size_t kMostNeighbours = 1000;  // that a wall is looked up for; against more it counts as outside

class Cutter {
 public:
  explicit Cutter(const std::vector<SplinterCell>& cells) : cells_(cells), made_(cells.size()) {}

  // Halves the list of cells, and cuts off what none of a half can reach: each cell then has little to cut.
  void cut(Polyhedron solid, std::span<int> cells) {
    if (solid.is_empty() || cells.empty() || is_full()) return;
    if (cells.size() == 1) return cut_cell(std::move(solid), cells.front());
    Eigen::AlignedBox3d box;
    for (const int c : cells) box.extend(cells_[c].box);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const auto middle = cells.begin() + std::ssize(cells) / 2;
    std::ranges::nth_element(cells, middle, {}, [&](int c) { return std::pair(cells_[c].box.center()[axis], c); });
    for (const std::span<int> half : {std::span(cells.begin(), middle), std::span(middle, cells.end())})
      cut(within_reach(solid, half), half);
  }

  bool is_full() const { return mesh_.surface.triangles.size() > kMostTriangles; }

  sim::SplinterMesh finish() {
    std::map<std::pair<int, int>, int> patch_on;  // by splinter and wall
    for (std::size_t t = 0; t < walls_.size(); ++t) {
      const auto [cell, wall] = walls_[t];
      if (wall == kOutside) {
        mesh_.patch.push_back(-1);
        continue;
      }
      const int own = mesh_.splinter[mesh_.surface.triangles[t][0]];
      const auto [patch, is_new] = patch_on.try_emplace({own, wall}, -1);
      if (is_new) patch->second = add_patch(own, cells_[cell].walls[wall]);
      mesh_.patch.push_back(patch->second);
    }
    return std::move(mesh_);
  }

 private:
  Polyhedron within_reach(const Polyhedron& solid, std::span<const int> cells) const {
    Eigen::AlignedBox3d box;
    for (const int c : cells) box.extend(cells_[c].box);
    const double spare = 1e-3 * box.sizes().maxCoeff();  // so that no wall of a cell is cut here already
    Polyhedron part = solid;
    for (int a = 0; a < 3; ++a) {
      part = clip(std::move(part), Vec3::Unit(a), box.max()[a] + spare, kOutside);
      part = clip(std::move(part), -Vec3::Unit(a), spare - box.min()[a], kOutside);
    }
    return part;
  }

  // What the wall's neighbours made next to the splinter; -1 if that is nothing, or a heap.
  int add_patch(int own, const SplinterCell::Wall& wall) {
    std::vector<int> others;
    for (const int c : wall.neighbours) {
      if (made_[c].size() > kMostNeighbours) return -1;
      for (const int s : made_[c])
        if (box_[s].intersects(box_[own])) others.push_back(s);
    }
    if (others.empty()) return -1;
    mesh_.patches.push_back({own, std::move(others)});
    return static_cast<int>(mesh_.patches.size()) - 1;
  }

  void cut_cell(Polyhedron solid, int cell) {
    const std::vector<SplinterCell::Wall>& walls = cells_[cell].walls;
    for (std::size_t w = 0; w < walls.size(); ++w)
      solid = clip(std::move(solid), walls[w].normal, walls[w].offset, static_cast<int>(w));
    for (const Polyhedron& part : parts(solid)) {
      const Eigen::AlignedBox3d box = box_of(part);
      const double length = box.sizes().maxCoeff();
      if (volume(part) > kLeastVolume * length * length * length && !is_full()) add(part, cell, box);
    }
  }

  void add(const Polyhedron& part, int cell, const Eigen::AlignedBox3d& box) {
    const Vec3 spare = Vec3::Constant(1e-6 * box.diagonal().norm());
    box_.emplace_back(box.min() - spare, box.max() + spare);
    const int first = static_cast<int>(mesh_.surface.vertices.size()), own = mesh_.count++;
    made_[cell].push_back(own);
    mesh_.surface.vertices.insert(mesh_.surface.vertices.end(), part.points.begin(), part.points.end());
    mesh_.splinter.resize(mesh_.surface.vertices.size(), own);
    for (const Polyhedron::Face& face : part.faces) {
      for (Triangle t : triangles_of(part.points, face.loops)) {
        for (int& v : t) v += first;
        mesh_.surface.triangles.push_back(t);
        walls_.push_back({cell, face.label});
      }
    }
  }

  struct Wall { int cell, wall; };
  const std::vector<SplinterCell>& cells_;
  std::vector<std::vector<int>> made_;  // splinters of each cell
  std::vector<Eigen::AlignedBox3d> box_;  // of each splinter, and a little more
  sim::SplinterMesh mesh_;
  std::vector<Wall> walls_;             // one a triangle: that it lies on
};

}  // namespace

Result<sim::SplinterMesh> cut_splinters(const Polyhedron& solid, const std::vector<SplinterCell>& cells) {
  std::vector<int> all;
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (!cells[c].box.isEmpty()) all.push_back(static_cast<int>(c));
  Cutter cutter(cells);
  cutter.cut(solid, all);
  if (cutter.is_full()) return invalid("size", text("makes more than ", kMostTriangles, " triangles, must make fewer"));
  return cutter.finish();
}

sim::SplinterMesh given_splinters(const sim::SurfaceMesh& surface) {
  const std::size_t n = surface.vertices.size();
  std::vector<int> part(n);
  std::iota(part.begin(), part.end(), 0);
  std::vector<char> used(n, 0);
  for (const Triangle& t : surface.triangles) {
    sim::unite(part, t[0], t[1]);
    sim::unite(part, t[0], t[2]);
    for (const int v : t) used[v] = 1;
  }
  sim::SplinterMesh mesh;
  std::vector<int> splinter_of(n, -1), new_id(n, -1);
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < n; ++v) {
    if (!used[v]) continue;
    int& own = splinter_of[sim::find_root(part, static_cast<int>(v))];
    if (own < 0) own = mesh.count++;
    new_id[v] = static_cast<int>(mesh.splinter.size());
    mesh.splinter.push_back(own);
    mesh.surface.vertices.push_back(surface.vertices[v]);
    box.extend(surface.vertices[v]);
  }
  const std::vector<int> place = sim::weld(mesh.surface.vertices, 1e-6 * box.diagonal().norm());
  std::map<Triangle, std::vector<int>> by_corners;  // triangles over the same places
  for (const Triangle& t : surface.triangles) {
    Triangle key{place[new_id[t[0]]], place[new_id[t[1]]], place[new_id[t[2]]]};
    std::ranges::sort(key);
    by_corners[key].push_back(static_cast<int>(mesh.surface.triangles.size()));
    mesh.surface.triangles.push_back({new_id[t[0]], new_id[t[1]], new_id[t[2]]});
  }
  mesh.patch.assign(mesh.surface.triangles.size(), -1);
  std::map<std::pair<int, int>, int> known;
  const auto owner = [&](int t) { return mesh.splinter[mesh.surface.triangles[t][0]]; };
  for (const auto& [corners, triangles] : by_corners) {
    if (triangles.size() != 2 || owner(triangles[0]) == owner(triangles[1])) continue;
    for (const int k : {0, 1}) {
      const int own = owner(triangles[k]), other = owner(triangles[1 - k]);
      const auto [patch, is_new] = known.try_emplace({own, other}, static_cast<int>(mesh.patches.size()));
      if (is_new) mesh.patches.push_back({own, {other}});
      mesh.patch[triangles[k]] = patch->second;
    }
  }
  return mesh;
}

sim::SurfaceMesh surface_of(const sim::TetMesh& mesh) {
  sim::SurfaceMesh surface;
  std::vector<int> id(mesh.X.size(), -1);
  for (const sim::SurfaceFace& face : sim::surface_faces(mesh.tets)) {
    Triangle t = face.nodes;
    for (int& n : t) {
      if (id[n] < 0) {
        id[n] = static_cast<int>(surface.vertices.size());
        surface.vertices.push_back(mesh.X[n]);
      }
      n = id[n];
    }
    surface.triangles.push_back(t);
  }
  return surface;
}

}  // namespace crumple::authoring
