#pragma once

#include "server/authoring/splinter_cells.h"

// How an artist scores an asset to break (Jones et al. 2016, section 5): cells that fill a box, as those of
// splinter_cells.h (stone, glass, wood, brick) do.
namespace crumple::authoring {

struct ScorePlane {
  Vec3 normal = Vec3::UnitX();  // of any length but 0
  double offset = 0;            // the plane: normal / |normal| . p = offset [m]
};

inline constexpr int kMaxScorePlanes = 100;
inline constexpr int kMaxScoreSites = 2000;

// What planes leave of a box; every plane goes all the way through. Errors: no plane or more than kMaxScorePlanes, a
// normal of length 0, values that are not finite, more than kMaxSplinterCells cells.
Result<std::vector<SplinterCell>> plane_cells(const Eigen::AlignedBox3d& box, const std::vector<ScorePlane>& planes);

// The Voronoi cells of given sites in a box, in their order; one that has no part of the box is empty. Errors: no site
// or more than kMaxScoreSites, sites that are not finite, two in one place.
Result<std::vector<SplinterCell>> voronoi_cells(const Eigen::AlignedBox3d& box, const std::vector<Vec3>& sites);

}  // namespace crumple::authoring
