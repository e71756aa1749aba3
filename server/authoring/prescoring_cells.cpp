#include "server/authoring/prescoring_cells.h"

#include "common/text.h"
#include "server/authoring/polyhedron.h"

#include <algorithm>
#include <map>
#include <set>

namespace crumple::authoring {
namespace {

constexpr double kLeastVolume = 1e-12;  // of a cell, over the box's

struct Half {
  Polyhedron solid;
  std::vector<char> above;  // of each plane so far
};

}  // namespace

Result<std::vector<SplinterCell>> plane_cells(const Eigen::AlignedBox3d& box, const std::vector<ScorePlane>& planes) {
  if (planes.empty() || planes.size() > kMaxScorePlanes)
    return invalid("planes", text("holds ", planes.size(), " planes, must hold 1 to ", kMaxScorePlanes));
  std::vector<Half> cells{{polyhedron_of(box), {}}};
  std::vector<Vec3> normals;
  for (std::size_t p = 0; p < planes.size(); ++p) {
    const ScorePlane& plane = planes[p];
    if (!plane.normal.allFinite() || !std::isfinite(plane.offset) || !(plane.normal.norm() > 0))
      return invalid(text("planes[", p, "]"), "must be finite, with a normal that is not 0");
    normals.push_back(plane.normal.normalized());
    std::vector<Half> next;
    for (const Half& cell : cells)
      for (const char above : {0, 1}) {
        const double side = above ? -1 : 1;
        Half half{clip(cell.solid, side * normals[p], side * plane.offset, static_cast<int>(p)), cell.above};
        half.above.push_back(above);
        if (volume(half.solid) > kLeastVolume * box.volume()) next.push_back(std::move(half));
      }
    cells = std::move(next);
    if (cells.size() > kMaxSplinterCells)
      return invalid("planes", text("make more than ", kMaxSplinterCells, " cells, must make fewer"));
  }
  std::map<std::vector<char>, int> id;
  for (std::size_t c = 0; c < cells.size(); ++c) id[cells[c].above] = static_cast<int>(c);
  std::vector<SplinterCell> out;
  for (const Half& cell : cells) {
    out.push_back({box_of(cell.solid), {}});
    std::set<int> walls;
    for (const Polyhedron::Face& face : cell.solid.faces)
      if (face.label != Polyhedron::kOutside) walls.insert(face.label);
    for (const int p : walls) {
      std::vector<char> across = cell.above;
      across[p] = !across[p];
      const double side = cell.above[p] ? -1 : 1;
      SplinterCell::Wall wall{side * normals[p], side * planes[p].offset, {}};
      if (const auto at = id.find(across); at != id.end()) wall.neighbours.push_back(at->second);
      out.back().walls.push_back(std::move(wall));
    }
  }
  return out;
}

Result<std::vector<SplinterCell>> voronoi_cells(const Eigen::AlignedBox3d& box, const std::vector<Vec3>& sites) {
  if (sites.empty() || sites.size() > kMaxScoreSites)
    return invalid("sites", text("holds ", sites.size(), " sites, must hold 1 to ", kMaxScoreSites));
  for (std::size_t a = 0; a < sites.size(); ++a) {
    if (!sites[a].allFinite()) return invalid(text("sites[", a, "]"), "is not finite");
    for (std::size_t b = 0; b < a; ++b)
      if (sites[a] == sites[b])
        return invalid(text("sites[", a, "]"), text("is where sites[", b, "] is, must be elsewhere"));
  }
  std::vector<SplinterCell> out;
  for (std::size_t a = 0; a < sites.size(); ++a) {
    const auto bisector = [&](std::size_t b) {  // the same numbers from both sides
      const Vec3 normal = (sites[b] - sites[a]).normalized();
      return SplinterCell::Wall{normal, normal.dot((sites[a] + sites[b]) / 2), {static_cast<int>(b)}};
    };
    Polyhedron cell = polyhedron_of(box);
    for (std::size_t b = 0; b < sites.size() && !cell.is_empty(); ++b) {
      if (b == a) continue;
      const SplinterCell::Wall wall = bisector(b);
      cell = clip(std::move(cell), wall.normal, wall.offset, static_cast<int>(b));
    }
    out.emplace_back();
    if (!(volume(cell) > kLeastVolume * box.volume())) continue;
    out.back().box = box_of(cell);
    std::set<int> walls;
    for (const Polyhedron::Face& face : cell.faces)
      if (face.label != Polyhedron::kOutside) walls.insert(face.label);
    for (const int b : walls) out.back().walls.push_back(bisector(static_cast<std::size_t>(b)));
  }
  return out;
}

}  // namespace crumple::authoring
