#include "server/authoring/prescored_parts.h"

#include "common/text.h"
#include "server/authoring/convex_parts.h"
#include "server/authoring/join_parts.h"
#include "server/authoring/polygon_triangles.h"
#include "server/authoring/polyhedron.h"
#include "server/authoring/tet_connectivity.h"
#include "server/authoring/tet_pieces.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/weld.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

namespace crumple::authoring {
namespace {

using sim::SurfaceMesh;
using sim::TetMesh;
using sim::TetTree;
using sim::example_based::ExampleSet;

constexpr double kLeastFace = 1e-9;  // area over length squared: what is less is rounding

// The pieces of one cell, in parts that hang together.
struct CellParts {
  TetPieces cut;
  std::map<int, int> piece_of;                     // of tets
  std::vector<int> part;                           // of each piece
  std::vector<std::vector<TetPiece::Face>> walls;  // of each piece: faces on walls, labelled by wall
};

double size_of(const Polygon& polygon) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : polygon) box.extend(p);
  return box.sizes().maxCoeff();
}

class Prescoring {
 public:
  Prescoring(const ExampleSet& asset, const std::vector<SplinterCell>& cells)
      : asset_(asset), cells_(cells), neighbours_(face_neighbours(asset.mesh.tets)), tree_(asset.mesh) {
    if (!asset.render.triangles.empty()) {
      if (auto solid = polyhedron_of(asset.render)) closed_ = std::move(*solid);
    }
    for (std::size_t c = 0; c < cells.size(); ++c) cut_cell(static_cast<int>(c));
    for (std::size_t c = 0; c < cells.size(); ++c) find_faces(static_cast<int>(c));
  }

  PrescoredAsset finish() {
    for (auto& [pair, face] : faces_) {
      face.centroid /= face.area;
      face.normal.normalize();
      out_.faces.push_back(face);
    }
    return std::move(out_);
  }

 private:
  void cut_cell(int cell) {
    CellParts& own = by_cell_.emplace_back();
    own.cut = tet_pieces(asset_.mesh, tree_, cells_[cell]);
    const int n = static_cast<int>(own.cut.pieces.size());
    for (int k = 0; k < n; ++k) own.piece_of[own.cut.pieces[k].tet] = k;
    std::vector<int> root(n);
    std::iota(root.begin(), root.end(), 0);
    own.walls.resize(n);
    for (int k = 0; k < n; ++k) {
      for (const TetPiece::Face& face : own.cut.pieces[k].faces) {
        if (face.label >= 0) {
          own.walls[k].push_back(face);
        } else if (const int across = across_face(own, k, face); across >= 0) {
          sim::unite(root, k, across);
        } else if (const int wall = wall_at(cells_[cell], own.cut.polygon(face)); wall >= 0) {
          own.walls[k].push_back({wall, face.points});
        }
      }
    }
    own.part.assign(n, -1);
    std::vector<std::vector<int>> pieces;  // of each part
    std::map<int, int> index;
    for (int k = 0; k < n; ++k) {
      const auto [at, fresh] = index.try_emplace(sim::find_root(root, k), static_cast<int>(pieces.size()));
      if (fresh) pieces.emplace_back();
      pieces[at->second].push_back(k);
    }
    std::vector<int> ids;
    for (const std::vector<int>& of_part : pieces) {
      std::optional<PrescoredPart> part = make_part(cell, own, of_part);
      if (!part) continue;
      for (const int k : of_part) own.part[k] = static_cast<int>(out_.parts.size());
      ids.push_back(static_cast<int>(out_.parts.size()));
      out_.parts.push_back(std::move(*part));
    }
    if (!ids.empty() && !asset_.render.triangles.empty()) draw(cell, ids, own);
  }

  bool is_face(const Polygon& polygon) const {
    const double size = size_of(polygon);
    return area_vector(polygon).norm() > kLeastFace * size * size;
  }

  // The piece in the same cell that lies against a piece's own face of its tet; -1: none.
  int across_face(const CellParts& own, int k, const TetPiece::Face& face) const {
    const int tet = own.cut.pieces[k].tet, other = neighbours_[tet][-1 - face.label];
    const auto at = other < 0 ? own.piece_of.end() : own.piece_of.find(other);
    if (at == own.piece_of.end() || !is_face(own.cut.polygon(face))) return -1;
    for (const TetPiece::Face& theirs : own.cut.pieces[at->second].faces)
      if (theirs.label < 0 && neighbours_[other][-1 - theirs.label] == tet && is_face(own.cut.polygon(theirs)))
        return at->second;
    return -1;
  }

  // The wall that a polygon lies on; -1: none.
  int wall_at(const SplinterCell& cell, const Polygon& polygon) const {
    const double tolerance = 1e-7 * size_of(polygon);
    for (std::size_t w = 0; w < cell.walls.size(); ++w)
      if (std::ranges::all_of(polygon, [&](const Vec3& p) {
            return std::abs(cell.walls[w].normal.dot(p) - cell.walls[w].offset) <= tolerance;
          }))
        return static_cast<int>(w);
    return -1;
  }

  // ---- a part's rig
  struct Place {
    int tet;
    Eigen::Vector4d weights;  // barycentric
  };

  Place place_of(int tet, const Vec3& p) const {
    Eigen::Vector4d w = sim::barycentric(sim::rest_corners(asset_.mesh, tet), p);
    w = (w.array() < 1e-9).select(0, w);
    return {tet, w / w.sum()};
  }

  // Nothing where its tets are all rounding.
  std::optional<PrescoredPart> make_part(int cell, const CellParts& own, const std::vector<int>& pieces) const {
    PrescoredPart part{.cell = cell};
    ExampleSet& set = part.set;
    std::vector<char> of_part(own.cut.pieces.size(), 0);
    for (const int k : pieces) of_part[k] = 1;
    std::vector<int> id(own.cut.points.size(), -1);
    std::vector<Place> places;
    for (std::size_t t = 0; t < own.cut.tets.size(); ++t) {
      if (!of_part[own.cut.piece[t]]) continue;
      const int source = own.cut.pieces[own.cut.piece[t]].tet;
      Tet tet = own.cut.tets[t];
      for (int& p : tet) {
        if (id[p] < 0) {
          id[p] = static_cast<int>(places.size());
          places.push_back(place_of(source, own.cut.points[p]));
          set.mesh.X.push_back(own.cut.points[p]);
        }
        p = id[p];
      }
      set.mesh.tets.push_back(tet);
      if (!asset_.mesh.fill.empty()) set.mesh.fill.push_back(asset_.mesh.fill[source]);
      if (!asset_.mesh.tags.empty()) set.mesh.tags.push_back(asset_.mesh.tags[source]);
      part.volume += sim::signed_volume(set.mesh, set.mesh.tet_count() - 1);
    }
    if (set.mesh.tets.empty()) return std::nullopt;
    restrict_rig(places, part);
    restrict_hulls(places, set);
    return part;
  }

  void restrict_rig(const std::vector<Place>& places, PrescoredPart& part) const {
    const auto N = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(N, asset_.W.cols());
    for (Eigen::Index v = 0; v < N; ++v)
      for (int k = 0; k < 4; ++k) W.row(v) += places[v].weights[k] * asset_.W.row(corner(places[v], k));
    for (int b = 0; b < W.cols(); ++b)
      if (W.col(b).maxCoeff() > 0) part.bones.push_back(b);
    part.set.W = W(Eigen::all, part.bones);
    for (const auto& example : asset_.examples) {
      part.set.examples.push_back({example.name, {}});
      for (const int b : part.bones) part.set.examples.back().bones.push_back(example.bones[b]);
    }
    const auto scales = [&](const std::vector<double>& of_asset, std::vector<double>& of_part) {
      if (of_asset.empty()) return;
      for (const Place& place : places) {
        of_part.push_back(0);
        for (int k = 0; k < 4; ++k) of_part.back() += place.weights[k] * of_asset[corner(place, k)];
      }
    };
    scales(asset_.alpha_scale, part.set.alpha_scale);
    scales(asset_.beta_scale, part.set.beta_scale);
  }

  int corner(const Place& place, int k) const { return asset_.mesh.tets[place.tet][k]; }

  // Of each hull of the asset: its own vertices that the part has, and new ones between them and others.
  void restrict_hulls(const std::vector<Place>& places, ExampleSet& set) const {
    const Vec3 far = Vec3::Constant(std::numeric_limits<double>::infinity());
    std::vector<int> all(places.size());
    std::iota(all.begin(), all.end(), 0);
    for (const std::vector<int>& hull : asset_.convex_parts) {
      std::vector<char> in_hull(asset_.mesh.X.size(), 0);
      for (const int v : hull) in_hull[v] = 1;
      std::vector<int> ids;
      for (const int v : all) {
        const auto belongs = [&](int k) { return places[v].weights[k] > 0 && in_hull[corner(places[v], k)]; };
        if (belongs(0) || belongs(1) || belongs(2) || belongs(3)) ids.push_back(v);
      }
      if (auto part = hull_part_in_box(set.mesh.X, ids, -far, far); !part.empty())
        set.convex_parts.push_back(std::move(part));
    }
    if (!set.convex_parts.empty()) return;
    if (auto part = hull_part_in_box(set.mesh.X, all, -far, far); !part.empty())
      set.convex_parts.push_back(std::move(part));
  }

  // ---- what is drawn
  void draw(int cell, const std::vector<int>& ids, const CellParts& own) {
    std::vector<std::vector<Polygon>> drawn(ids.size());
    if (closed_) {
      Polyhedron solid = *closed_;
      for (const auto& wall : cells_[cell].walls) solid = clip(std::move(solid), wall.normal, wall.offset, 0);
      for (const Polyhedron& one : parts(solid)) {
        std::vector<Polygon>& to = drawn[nearest_part(ids, one.points)];
        for (const Polyhedron::Face& face : one.faces)
          for (const Triangle& t : triangles_of(one.points, face.loops))
            to.push_back({one.points[t[0]], one.points[t[1]], one.points[t[2]]});
      }
    } else {
      for (const Triangle& t : asset_.render.triangles) {
        const auto& X = asset_.render.vertices;
        Polygon polygon{X[t[0]], X[t[1]], X[t[2]]};
        for (const auto& wall : cells_[cell].walls) polygon = clip(polygon, wall.normal, wall.offset);
        if (!polygon.empty()) drawn[nearest_part(ids, polygon)].push_back(std::move(polygon));
      }
      for (std::size_t k = 0; k < own.walls.size(); ++k)
        for (const TetPiece::Face& face : own.walls[k])
          if (own.part[k] >= 0) drawn[own.part[k] - ids.front()].push_back(own.cut.polygon(face));
    }
    for (std::size_t k = 0; k < ids.size(); ++k) out_.parts[ids[k]].set.render = surface_of_polygons(drawn[k]);
  }

  // Of the parts of one cell, that whose tets are nearest to the mean of points: an index into `ids`.
  std::size_t nearest_part(const std::vector<int>& ids, const std::vector<Vec3>& points) const {
    if (ids.size() == 1) return 0;
    Vec3 mean = Vec3::Zero();
    for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
    std::vector<double> distance;
    for (const int part : ids) {
      const TetMesh& mesh = out_.parts[part].set.mesh;
      double nearest = std::numeric_limits<double>::infinity();
      for (int t = 0; t < mesh.tet_count(); ++t)
        nearest = std::min(nearest, sim::squared_distance(sim::rest_corners(mesh, t), mean));
      distance.push_back(nearest);
    }
    return static_cast<std::size_t>(std::ranges::min_element(distance) - distance.begin());
  }

  static SurfaceMesh surface_of_polygons(const std::vector<Polygon>& polygons) {
    std::vector<Vec3> points;
    for (const Polygon& polygon : polygons) points.insert(points.end(), polygon.begin(), polygon.end());
    const std::vector<int> first = sim::weld(points, 0);
    SurfaceMesh out;
    std::vector<int> id(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
      const bool fresh = first[p] == static_cast<int>(p);
      id[p] = fresh ? static_cast<int>(out.vertices.size()) : id[first[p]];
      if (fresh) out.vertices.push_back(points[p]);
    }
    std::size_t at = 0;
    for (const Polygon& polygon : polygons) {
      for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
        const Triangle t{id[at], id[at + k], id[at + k + 1]};
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) out.triangles.push_back(t);
      }
      at += polygon.size();
    }
    return out;
  }

  // ---- what lies against what
  void find_faces(int cell) {
    const CellParts& own = by_cell_[cell];
    for (std::size_t k = 0; k < own.walls.size(); ++k) {
      if (own.part[k] < 0) continue;
      for (const TetPiece::Face& face : own.walls[k]) {
        const SplinterCell::Wall& wall = cells_[cell].walls[face.label];
        const Polygon polygon = own.cut.polygon(face);
        for (const int other : wall.neighbours)
          if (other > cell)
            add_face(own.part[k], own.cut.pieces[k].tet, other, wall, polygon, wall.neighbours.size() > 1);
      }
    }
  }

  void add_face(int part, int tet, int cell, const SplinterCell::Wall& wall, Polygon polygon, bool shared_wall) {
    if (shared_wall)  // only what the neighbour's other walls leave
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
    if (const auto at = theirs.piece_of.find(tet); at != theirs.piece_of.end()) return theirs.part[at->second];
    for (const int beside : neighbours_[tet])
      if (const auto at = theirs.piece_of.find(beside); at != theirs.piece_of.end()) return theirs.part[at->second];
    return -1;
  }

  const ExampleSet& asset_;
  const std::vector<SplinterCell>& cells_;
  std::vector<std::array<int, 4>> neighbours_;
  TetTree tree_;
  std::optional<Polyhedron> closed_;  // the surface that is drawn, if it is
  std::vector<CellParts> by_cell_;
  std::map<std::pair<int, int>, PrescoredFace> faces_;
  PrescoredAsset out_;
};

Result<void> check(const std::vector<SplinterCell>& cells) {
  if (cells.empty()) return invalid("cells", "is empty, must hold at least one cell");
  const int count = static_cast<int>(cells.size());
  for (int c = 0; c < count; ++c)
    for (const SplinterCell::Wall& wall : cells[c].walls)
      for (const int other : wall.neighbours)
        if (other < 0 || other >= count || other == c)
          return invalid(text("cells[", c, "].walls"),
                         text("name neighbour ", other, ", must name another of ", count));
  return {};
}

double total_volume(const TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += sim::signed_volume(mesh, t);
  return sum;
}

}  // namespace

Result<PrescoredAsset> prescored_parts(const ExampleSet& asset, const std::vector<SplinterCell>& cells,
                                       const PrescoringOptions& options) {
  if (!(options.least_part >= 0 && options.least_part < 1))
    return invalid("least_part", text("is ", options.least_part, ", must be in [0, 1)"));
  if (auto ok = sim::example_based::validate(asset, "asset"); !ok) return std::unexpected(ok.error());
  if (auto ok = check(cells); !ok) return std::unexpected(ok.error());
  PrescoredAsset out = Prescoring(asset, cells).finish();
  double volume = 0;
  for (const PrescoredPart& part : out.parts) volume += part.volume;
  const double whole = total_volume(asset.mesh);
  if (std::abs(volume - whole) > 1e-6 * whole)
    return invalid("cells", text("hold ", volume / whole, " of the asset's volume, must hold all of it, once"));
  out = with_small_parts_joined(std::move(out), options.least_part * volume / static_cast<double>(out.parts.size()));
  for (std::size_t p = 0; p < out.parts.size(); ++p)
    if (auto ok = sim::example_based::validate(out.parts[p].set, text("parts[", p, "]")); !ok)
      return std::unexpected(ok.error());
  return out;
}

}  // namespace crumple::authoring
