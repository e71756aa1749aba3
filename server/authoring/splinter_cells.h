#pragma once

#include "common/error.h"
#include "common/types.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <vector>

// How materials come apart: cells that fill space, for splinters (Parker & O'Brien 2009, section 5: "tools that take an
// object and automatically subdivide it into appropriately shaped splinters").
namespace crumple::authoring {

// A convex cell: the points with normal . p <= offset for all of its walls.
struct SplinterCell {
  struct Wall {
    Vec3 normal;                // unit length
    double offset;              // [m]
    std::vector<int> neighbours;  // cells on the other side
  };
  Eigen::AlignedBox3d box;
  std::vector<Wall> walls;
};

inline constexpr int kMaxSplinterCells = 100'000;

// Each fills `box` with its cells. size: edge or width of a cell [m], > 0. INVALID, with field `size`, if that makes more
// than kMaxSplinterCells. Random ones follow the seed alone.

// Rounded lumps: Voronoi cells of points that are one to a cube of a lattice, anywhere in it.
Result<std::vector<SplinterCell>> stone_cells(const Eigen::AlignedBox3d& box, double size, std::uint64_t seed);

// Pointed shards of at most size^2 that go through the sheet (glass_shards.h). The thinnest side of the box is its thickness.
Result<std::vector<SplinterCell>> glass_cells(const Eigen::AlignedBox3d& box, double size, std::uint64_t seed);

// Pointed slivers along the grain: Voronoi cells in space that is shortened along it. grain: unit length. aspect: length
// over width, >= 1.
Result<std::vector<SplinterCell>> wood_cells(const Eigen::AlignedBox3d& box, double size, double aspect, const Vec3& grain,
                                             std::uint64_t seed);

// A wall's bond: blocks with x, y and z as `size` says, in courses along y, each half a block from the ones beside it.
Result<std::vector<SplinterCell>> brick_cells(const Eigen::AlignedBox3d& box, const Vec3& size);

}  // namespace crumple::authoring
