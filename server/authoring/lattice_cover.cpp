#include "server/authoring/lattice_cover.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace crumple::authoring {
namespace {

constexpr double kSlack = 1e-9;  // [cells]; rounding of a lattice of up to 1e6 cells stays below it

using UnitTriangle = std::array<Vec3, 3>;  // corners in cells from the lattice's origin

// Area vector (twice) of what is left of a triangle inside a tet.
Vec3 clipped_area(const UnitTriangle& triangle, const std::array<Vec3, 4>& tet) {
  std::array<Vec3, 8> polygon{triangle[0], triangle[1], triangle[2]}, next;
  int count = 3;
  constexpr std::array<Triangle, 4> kFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  for (const Triangle& face : kFaces) {
    const Vec3 n = (tet[face[1]] - tet[face[0]]).cross(tet[face[2]] - tet[face[0]]).normalized();
    const auto height = [&](const Vec3& p) { return n.dot(p - tet[face[0]]) - kSlack; };
    int kept = 0;
    for (int k = 0; k < count; ++k) {
      const Vec3 &a = polygon[k], &b = polygon[(k + 1) % count];
      const double ha = height(a), hb = height(b);
      if (ha <= 0) next[kept++] = a;
      if ((ha < 0 && hb > 0) || (ha > 0 && hb < 0)) next[kept++] = a + (b - a) * (ha / (ha - hb));
    }
    count = kept;
    std::swap(polygon, next);
    if (count < 3) return Vec3::Zero();
  }
  Vec3 area = Vec3::Zero();
  for (int k = 1; k + 1 < count; ++k) area += (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]);
  return area;
}

// Smallest barycentric coordinate of p: >= 0 inside.
double depth_in_tet(const Vec3& p, const std::array<Vec3, 4>& tet) {
  Mat3 D;
  D << tet[1] - tet[0], tet[2] - tet[0], tet[3] - tet[0];
  const Vec3 b = D.inverse() * (p - tet[0]);
  return std::min(b.minCoeff(), 1 - b.sum());
}

class Classifier {
 public:
  explicit Classifier(const BccLattice& lattice) : lattice_(lattice), cover_(lattice.tet_slots(), Cover::outside) {}

  Vec3 unit(const Vec3& p) const { return (p - lattice_.origin) / lattice_.h; }

  void mark_cut_by(const UnitTriangle& triangle) {
    const Vec3 lower = triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]);
    const Vec3 upper = triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]);
    const Vec3 area = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    // A piece counts from a billionth of the triangle, or of a cell's face where the triangle is larger.
    const double least = 1e-9 * std::min(area.norm(), 1.0);
    if (area.norm() == 0) return;
    const Vec3 n = area.normalized();
    for_each_edge(lower, upper, [&](const std::array<int, 3>& c, int axis) {
      Vec3 middle(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
      middle[axis] += 0.5;
      if (std::abs(n.dot(middle - triangle[0])) > std::sqrt(0.5) + kSlack) return;  // circumradius of the four tets
      for (int q = 0; q < 4; ++q) {
        Cover& cover = cover_[lattice_.tet_id(c, axis, q)];
        if (cover != Cover::cut && clipped_area(triangle, lattice_.unit_corners(c, axis, q)).norm() > least)
          cover = Cover::cut;
      }
    });
  }

  void mark_tet_of(const Vec3& p) {
    double best = -1;
    std::int64_t tet = -1;
    for_each_edge(p, p, [&](const std::array<int, 3>& c, int axis) {
      for (int q = 0; q < 4; ++q) {
        const std::int64_t id = lattice_.tet_id(c, axis, q);
        const double depth = depth_in_tet(p, lattice_.unit_corners(c, axis, q));
        // A marked tet that holds the vertex within rounding is enough.
        const double score = depth > -kSlack && cover_[id] == Cover::cut ? 1.0 + depth : depth;
        if (score > best) {
          best = score;
          tet = id;
        }
      }
    });
    cover_[tet] = Cover::cut;
  }

  // Blocks of cells that the surface does not come near are all solid or all outside; elsewhere each tet asks.
  void mark_solid(const WindingNumber& solid, const SurfaceDistance& distance) {
    const auto& n = lattice_.cells;
    for (int i = 0; i < n[0]; i += kBlock)
      for (int j = 0; j < n[1]; j += kBlock)
        for (int k = 0; k < n[2]; k += kBlock) mark_block({i, j, k}, solid, distance);
  }

  std::vector<Cover> take() { return std::move(cover_); }

 private:
  static constexpr int kBlock = 4;

  // All cell-centre edges whose four tets may touch the box [lower, upper] (in cells).
  template <class Visit>
  void for_each_edge(const Vec3& lower, const Vec3& upper, const Visit& visit) const {
    for (int axis = 0; axis < 3; ++axis) {
      std::array<int, 3> lo, hi;
      for (int d = 0; d < 3; ++d) {
        const double shift = d == axis ? 0.5 : 0.0;  // from centre to centre along the edge, a cell across
        lo[d] = std::max(0, static_cast<int>(std::floor(lower[d] - shift - kSlack)));
        hi[d] =
            std::min(lattice_.cells[d] - (d == axis ? 2 : 1), static_cast<int>(std::floor(upper[d] - shift + kSlack)));
      }
      for (int i = lo[0]; i <= hi[0]; ++i)
        for (int j = lo[1]; j <= hi[1]; ++j)
          for (int k = lo[2]; k <= hi[2]; ++k) visit(std::array<int, 3>{i, j, k}, axis);
    }
  }

  void mark_block(const std::array<int, 3>& first, const WindingNumber& solid, const SurfaceDistance& distance) {
    const Vec3 centre =
        lattice_.origin + lattice_.h * (Vec3(first[0], first[1], first[2]).array() + kBlock / 2.0).matrix();
    // Tets reach half a cell beyond the block along their edge.
    const double radius = lattice_.h * std::sqrt(3.0) * (kBlock / 2.0 + 0.5);
    const double w = solid(centre);
    const bool clear = (w < 0.1 || w > 0.9) && distance(centre) > radius;
    if (clear && w < 0.5) return;
    for (int i = first[0]; i < std::min(first[0] + kBlock, lattice_.cells[0]); ++i)
      for (int j = first[1]; j < std::min(first[1] + kBlock, lattice_.cells[1]); ++j)
        for (int k = first[2]; k < std::min(first[2] + kBlock, lattice_.cells[2]); ++k)
          for (int axis = 0; axis < 3; ++axis) mark_edge({i, j, k}, axis, clear, solid);
  }

  // The four tets around a cell-centre edge. Where none is cut they are one piece of space, and its middle answers for
  // all.
  void mark_edge(const std::array<int, 3>& c, int axis, bool known_solid, const WindingNumber& solid) {
    if (c[axis] + 1 >= lattice_.cells[axis]) return;
    Cover* tets = &cover_[lattice_.tet_id(c, axis, 0)];
    const bool whole = std::find(tets, tets + 4, Cover::cut) == tets + 4;
    if (whole) {
      Vec3 middle = Vec3(c[0], c[1], c[2]) + Vec3::Constant(0.5) + 0.5 * Vec3::Unit(axis);
      if (known_solid || solid.inside(lattice_.origin + lattice_.h * middle)) std::fill(tets, tets + 4, Cover::solid);
      return;
    }
    for (int q = 0; q < 4; ++q) {
      if (tets[q] == Cover::cut) continue;
      const auto x = lattice_.corners(lattice_.tet_id(c, axis, q));
      if (known_solid || solid.inside((x[0] + x[1] + x[2] + x[3]) / 4)) tets[q] = Cover::solid;
    }
  }

  const BccLattice& lattice_;
  std::vector<Cover> cover_;
};

}  // namespace

BccLattice lattice_around(const sim::SurfaceMesh& surface, double h) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : surface.vertices) box.extend(v);
  BccLattice lattice{.origin = Vec3::Zero(), .h = h, .cells = {}};
  for (int d = 0; d < 3; ++d) {
    // A box of a whole number of cells stays that number in spite of rounding; two more cells lie around it.
    const double cells = std::max(1.0, std::ceil(box.sizes()[d] / h - 1e-6)) + 2;
    lattice.cells[d] = static_cast<int>(std::min(cells, 1e6));
    lattice.origin[d] = box.center()[d] - lattice.cells[d] * h / 2;
  }
  return lattice;
}

std::vector<Cover> classify(const BccLattice& lattice, const sim::SurfaceMesh& surface, const WindingNumber& solid,
                            const SurfaceDistance& distance) {
  Classifier classifier(lattice);
  const auto unit = [&](int v) { return classifier.unit(surface.vertices[v]); };
  for (const Triangle& t : surface.triangles) classifier.mark_cut_by({unit(t[0]), unit(t[1]), unit(t[2])});
  for (const Vec3& v : surface.vertices) classifier.mark_tet_of(classifier.unit(v));
  classifier.mark_solid(solid, distance);
  return classifier.take();
}

}  // namespace crumple::authoring
