#include "server/authoring/bcc_lattice.h"

#include "server/authoring/tet_connectivity.h"
#include "server/sim/mesh/tet_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

const BccLattice kLattice{.origin = Vec3(1, 2, 3), .h = 0.5, .cells = {4, 3, 5}};

// Inner angle between the faces opposite nodes a and b [degrees].
double dihedral(const std::array<Vec3, 4>& x, int a, int b) {
  const auto inward = [&](int opposite) {
    const Vec3 &p = x[(opposite + 1) % 4], &q = x[(opposite + 2) % 4], &r = x[(opposite + 3) % 4];
    const Vec3 n = (q - p).cross(r - p).normalized();
    return Vec3(n.dot(x[opposite] - p) > 0 ? n : -n);
  };
  return 180 - std::acos(std::clamp(inward(a).dot(inward(b)), -1.0, 1.0)) * 180 / std::numbers::pi;
}

template <class Visit>
void for_each_tet(const BccLattice& lattice, const Visit& visit) {
  for (std::int64_t id = 0; id < lattice.tet_slots(); ++id)
    if (lattice.exists(id)) visit(id);
}

TEST(BccLattice, DihedralAnglesAre60And90Degrees) {
  for_each_tet(kLattice, [&](std::int64_t id) {
    const auto x = kLattice.corners(id);
    int right = 0;
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) {
        const double angle = dihedral(x, a, b);
        right += std::abs(angle - 90) < 1e-6;
        EXPECT_TRUE(std::abs(angle - 90) < 1e-6 || std::abs(angle - 60) < 1e-6) << angle;
      }
    EXPECT_EQ(right, 2);
  });
}

TEST(BccLattice, TetsAreCongruentAndPositive) {
  for_each_tet(kLattice, [&](std::int64_t id) {
    const auto x = kLattice.corners(id);
    EXPECT_NEAR((x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0])) / 6, std::pow(kLattice.h, 3) / 12, 1e-15);
    EXPECT_NEAR((x[1] - x[0]).norm(), kLattice.h, 1e-15);
    EXPECT_NEAR((x[3] - x[2]).norm(), kLattice.h, 1e-15);
  });
}

TEST(BccLattice, FillsTheInnerCellsWithoutGapsOrOverlaps) {
  std::vector<Tet> tets;
  for_each_tet(kLattice, [&](std::int64_t id) {
    const auto n = kLattice.nodes(id);
    tets.push_back({static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]), static_cast<int>(n[3])});
  });
  // Interior faces of the cells, four tets each.
  EXPECT_EQ(tets.size(), 4u * (3 * 3 * 5 + 4 * 2 * 5 + 4 * 3 * 4));
  const auto neighbours = face_neighbours(tets);
  EXPECT_EQ(face_parts(neighbours).count, 1);
  for (size_t t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      if (neighbours[t][k] >= 0) continue;
      // Without a neighbour only where a centre belongs to an outer cell.
      const double margin = 0.51 * kLattice.h;
      bool outer = false;
      for (const int node : tets[t]) {
        const Vec3 p = kLattice.position(node) - kLattice.origin;
        for (int d = 0; d < 3; ++d) outer = outer || p[d] < margin || p[d] > kLattice.h * kLattice.cells[d] - margin;
      }
      EXPECT_TRUE(outer);
    }
}

TEST(BccLattice, UnitCornersAreTheCornersInCells) {
  for_each_tet(kLattice, [&](std::int64_t id) {
    const auto slot = kLattice.slot(id);
    EXPECT_EQ(kLattice.tet_id(slot.cell, slot.axis, slot.quarter), id);
    const auto x = kLattice.corners(id), u = kLattice.unit_corners(slot.cell, slot.axis, slot.quarter);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR((kLattice.origin + kLattice.h * u[k] - x[k]).norm(), 0, 1e-14);
  });
}

}  // namespace
}  // namespace crumple::authoring
