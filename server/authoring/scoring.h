#pragma once

#include "server/authoring/prescoring_cells.h"
#include "server/sim/example_based/example_set.h"

namespace crumple::authoring {

// How an artist asks for an asset to be scored (Jones et al. 2016, section 5). Lengths in metres, in the asset's axes.
struct ScoreOptions {
  enum class By { planes, voronoi, bricks, wood, stone, glass } by = By::voronoi;
  std::vector<ScorePlane> planes;  // none: pieces - 1 across the longest axis, evenly
  int pieces = 8;                  // Voronoi sites, anywhere inside; or slabs; [2, 1000]
  double size = 0;    // of a lump, shard, sliver's width or brick's length; 0: a quarter of the longest side,
                      // a tenth for wood
  double aspect = 6;  // wood: length over width, [1, 1000]
  Vec3 direction = Vec3::Zero();  // wood: of the grain; 0: the longest axis
  Vec3 block = Vec3::Zero();      // bricks: of one; 0: size, size / 2, size / 2
  std::uint64_t seed = 1;
};

inline constexpr int kMostPieces = 1000;

// Cells that fill the asset's box. Errors name the option: pieces, size, aspect, direction or block out of range, more
// than kMaxSplinterCells cells, what plane_cells and voronoi_cells reject.
Result<std::vector<SplinterCell>> scored_cells(const sim::example_based::ExampleSet& asset,
                                               const ScoreOptions& options);

}  // namespace crumple::authoring
