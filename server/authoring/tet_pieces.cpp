#include "server/authoring/tet_pieces.h"

#include "server/authoring/polyhedron.h"
#include "server/sim/mesh/tet_faces.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

constexpr double kThinnest = 1e-10;  // volume over length cubed
constexpr double kSamePlace = 1e-9;  // of the mesh's size

Polyhedron polyhedron_of_tet(const Mat34& X) {
  Polyhedron out;
  for (int k = 0; k < 4; ++k) out.points.push_back(X.col(k));
  for (int k = 0; k < 4; ++k) {
    const Triangle& t = sim::kTetFaces[k];
    out.faces.push_back({-1 - k, {{t[0], t[1], t[2]}}});
  }
  return out;
}

bool is_thin(double volume, const Eigen::AlignedBox3d& box) {
  return !(volume > kThinnest * std::pow(box.sizes().maxCoeff(), 3));
}

// Points of which none follows itself.
std::vector<int> without_repeats(const std::vector<int>& loop) {
  std::vector<int> out;
  for (const int p : loop)
    if (out.empty() || out.back() != p) out.push_back(p);
  while (out.size() > 1 && out.front() == out.back()) out.pop_back();
  return out;
}

void add_tets(TetPieces& all, int piece) {
  int apex = static_cast<int>(all.points.size());
  for (const TetPiece::Face& face : all.pieces[piece].faces) apex = std::min(apex, std::ranges::min(face.points));
  for (const TetPiece::Face& face : all.pieces[piece].faces) {
    const std::vector<int>& p = face.points;
    if (std::ranges::find(p, apex) != p.end()) continue;
    const std::size_t n = p.size(), first = static_cast<std::size_t>(std::ranges::min_element(p) - p.begin());
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const Tet tet{apex, p[first], p[(first + k) % n], p[(first + k + 1) % n]};
      Mat34 X;
      Eigen::AlignedBox3d box;
      for (int c = 0; c < 4; ++c) {
        X.col(c) = all.points[tet[c]];
        box.extend(all.points[tet[c]]);
      }
      const double volume = (X.rightCols<3>().colwise() - X.col(0)).determinant() / 6;
      if (is_thin(volume, box)) continue;
      all.tets.push_back(tet);
      all.piece.push_back(piece);
    }
  }
}

}  // namespace

Polygon TetPieces::polygon(const TetPiece::Face& face) const {
  Polygon out;
  for (const int p : face.points) out.push_back(points[p]);
  return out;
}

TetPieces tet_pieces(const sim::TetMesh& mesh, const sim::TetTree& tree, const SplinterCell& cell) {
  TetPieces out;
  if (cell.box.isEmpty()) return out;
  std::vector<Vec3> points;
  for (const int t : tree.near(cell.box)) {
    Polyhedron solid = polyhedron_of_tet(sim::rest_corners(mesh, t));
    for (std::size_t w = 0; w < cell.walls.size() && !solid.is_empty(); ++w)
      solid = clip(std::move(solid), cell.walls[w].normal, cell.walls[w].offset, static_cast<int>(w));
    if (solid.is_empty() || is_thin(volume(solid), box_of(solid))) continue;
    TetPiece piece{t, {}};
    const int first = static_cast<int>(points.size());
    points.insert(points.end(), solid.points.begin(), solid.points.end());
    for (const Polyhedron::Face& face : solid.faces) {
      piece.faces.push_back({face.label, face.loops.front()});  // convex: one loop
      for (int& p : piece.faces.back().points) p += first;
    }
    out.pieces.push_back(std::move(piece));
  }

  Eigen::AlignedBox3d box;
  for (const Vec3& X : mesh.X) box.extend(X);
  const std::vector<int> same = sim::weld(points, kSamePlace * box.diagonal().norm());
  std::vector<int> id(points.size(), -1);
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (same[p] == static_cast<int>(p)) {
      id[p] = static_cast<int>(out.points.size());
      out.points.push_back(points[p]);
    } else {
      id[p] = id[same[p]];
    }
  }
  for (TetPiece& piece : out.pieces) {
    for (TetPiece::Face& face : piece.faces) {
      for (int& p : face.points) p = id[p];
      face.points = without_repeats(face.points);
    }
    std::erase_if(piece.faces, [](const TetPiece::Face& face) { return face.points.size() < 3; });
  }
  for (std::size_t k = 0; k < out.pieces.size(); ++k) add_tets(out, static_cast<int>(k));
  return out;
}

}  // namespace crumple::authoring
