#include "server/authoring/cell_parts.h"

#include "server/sim/mesh/disjoint_sets.h"

#include <algorithm>
#include <numeric>

namespace crumple::authoring {
namespace {

constexpr double kLeastFace = 1e-9;

double size_of(const Polygon& polygon) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : polygon) box.extend(p);
  return box.sizes().maxCoeff();
}

// The piece in the same cell that lies against a piece's own face of its tet; -1: none.
int across_face(const CellParts& own, const std::vector<std::array<int, 4>>& neighbours, int k,
                const TetPiece::Face& face) {
  const int tet = own.cut.pieces[k].tet, other = neighbours[tet][-1 - face.label];
  const auto at = other < 0 ? own.piece_of.end() : own.piece_of.find(other);
  if (at == own.piece_of.end() || !is_face(own.cut.polygon(face))) return -1;
  for (const TetPiece::Face& theirs : own.cut.pieces[at->second].faces)
    if (theirs.label < 0 && neighbours[other][-1 - theirs.label] == tet && is_face(own.cut.polygon(theirs)))
      return at->second;
  return -1;
}

// The wall that a polygon lies on; -1: none.
int wall_at(const SplinterCell& cell, const Polygon& polygon) {
  const double tolerance = 1e-7 * size_of(polygon);
  for (std::size_t w = 0; w < cell.walls.size(); ++w)
    if (std::ranges::all_of(polygon, [&](const Vec3& p) {
          return std::abs(cell.walls[w].normal.dot(p) - cell.walls[w].offset) <= tolerance;
        }))
      return static_cast<int>(w);
  return -1;
}

}  // namespace

bool is_face(const Polygon& polygon) {
  const double size = size_of(polygon);
  return area_vector(polygon).norm() > kLeastFace * size * size;
}

CellParts cell_parts(const sim::TetMesh& mesh, const sim::TetTree& tree,
                     const std::vector<std::array<int, 4>>& neighbours, const SplinterCell& cell) {
  CellParts own;
  own.cut = tet_pieces(mesh, tree, cell);
  const int n = static_cast<int>(own.cut.pieces.size());
  for (int k = 0; k < n; ++k) own.piece_of[own.cut.pieces[k].tet] = k;
  std::vector<int> root(n);
  std::iota(root.begin(), root.end(), 0);
  own.walls.resize(n);
  for (int k = 0; k < n; ++k) {
    for (const TetPiece::Face& face : own.cut.pieces[k].faces) {
      if (face.label >= 0) {
        own.walls[k].push_back(face);
      } else if (const int across = across_face(own, neighbours, k, face); across >= 0) {
        sim::unite(root, k, across);
      } else if (const int wall = wall_at(cell, own.cut.polygon(face)); wall >= 0) {
        own.walls[k].push_back({wall, face.points});
      }
    }
  }
  std::map<int, int> index;
  for (int k = 0; k < n; ++k)
    own.part.push_back(index.try_emplace(sim::find_root(root, k), static_cast<int>(index.size())).first->second);
  own.parts = static_cast<int>(index.size());
  return own;
}

}  // namespace crumple::authoring
