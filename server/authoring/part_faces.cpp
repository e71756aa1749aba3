#include "server/authoring/part_faces.h"

#include <algorithm>
#include <map>

namespace crumple::authoring {
namespace {

class FaceFinder {
 public:
  FaceFinder(const std::vector<std::array<int, 4>>& neighbours, const std::vector<SplinterCell>& cells,
             const std::vector<CellParts>& by_cell, const std::vector<std::vector<int>>& part_of)
      : neighbours_(neighbours), cells_(cells), by_cell_(by_cell), part_of_(part_of) {}

  void find(int cell) {
    const CellParts& own = by_cell_[cell];
    for (std::size_t k = 0; k < own.walls.size(); ++k) {
      const int part = part_of_[cell][own.part[k]];
      if (part < 0) continue;
      for (const TetPiece::Face& face : own.walls[k]) {
        const SplinterCell::Wall& wall = cells_[cell].walls[face.label];
        const Polygon polygon = own.cut.polygon(face);
        for (const int other : wall.neighbours)
          if (other > cell) add(part, own.cut.pieces[k].tet, other, wall, polygon);
      }
    }
  }

  std::vector<PrescoredFace> finish() {
    std::vector<PrescoredFace> out;
    for (auto& [pair, face] : faces_) {
      face.centroid /= face.area;
      face.normal.normalize();
      out.push_back(face);
    }
    return out;
  }

 private:
  void add(int part, int tet, int cell, const SplinterCell::Wall& wall, Polygon polygon) {
    if (wall.neighbours.size() > 1)  // only what the neighbour's other walls leave
      for (const auto& theirs : cells_[cell].walls)
        if (!(theirs.normal.dot(wall.normal) < -1 + 1e-9)) polygon = clip(polygon, theirs.normal, theirs.offset);
    if (polygon.empty() || !is_face(polygon)) return;
    const int other = part_in(cell, tet);
    if (other < 0) return;
    PrescoredFace& face = faces_.try_emplace(std::minmax(part, other)).first->second;
    const Vec3 area = area_vector(polygon);
    if (face.area == 0) face = {.a = std::min(part, other), .b = std::max(part, other), .normal = Vec3::Zero()};
    face.area += area.norm();
    face.centroid += area_moment(polygon);
    face.normal += part < other ? area : Vec3(-area);
  }

  // The part of a cell that has a piece of the tet or, where the wall goes along its face, of one beside it; -1: none.
  int part_in(int cell, int tet) const {
    const CellParts& theirs = by_cell_[cell];
    const auto part_at = [&](int piece) { return part_of_[cell][theirs.part[piece]]; };
    if (const auto at = theirs.piece_of.find(tet); at != theirs.piece_of.end()) return part_at(at->second);
    for (const int beside : neighbours_[tet])
      if (const auto at = theirs.piece_of.find(beside); at != theirs.piece_of.end()) return part_at(at->second);
    return -1;
  }

  const std::vector<std::array<int, 4>>& neighbours_;
  const std::vector<SplinterCell>& cells_;
  const std::vector<CellParts>& by_cell_;
  const std::vector<std::vector<int>>& part_of_;
  std::map<std::pair<int, int>, PrescoredFace> faces_;
};

}  // namespace

std::vector<PrescoredFace> part_faces(const std::vector<std::array<int, 4>>& neighbours,
                                      const std::vector<SplinterCell>& cells, const std::vector<CellParts>& by_cell,
                                      const std::vector<std::vector<int>>& part_of) {
  FaceFinder finder(neighbours, cells, by_cell, part_of);
  for (std::size_t c = 0; c < cells.size(); ++c) finder.find(static_cast<int>(c));
  return finder.finish();
}

}  // namespace crumple::authoring
