#pragma once

#include "server/authoring/splinter_cells.h"
#include "server/sim/example_based/example_set.h"

namespace crumple::authoring {

// One piece of an asset that is scored to break: a rig of its own, in the asset's axes.
struct PrescoredPart {
  sim::example_based::ExampleSet set;  // passes validate; its examples are the asset's, in their order
  std::vector<int> bones;              // of the asset, one a column of set.W: those that act on it
  int cell = 0;                        // that it was cut by
  double volume = 0;                   // of its tets, full [m^3]
};

// Where two parts lie against each other, all of it: what a constraint holds together.
struct PrescoredFace {
  int a = 0, b = 0;              // parts, a < b
  double area = 0;               // [m^2]
  Vec3 centroid = Vec3::Zero();  // at rest, in the asset's axes [m]
  Vec3 normal = Vec3::UnitX();   // mean of the area, from a to b, unit length
};

struct PrescoringOptions {
  double least_part = 0.01;  // of the mean part's volume: a smaller part is joined to a neighbour [-], [0, 1)
};

struct PrescoredAsset {
  std::vector<PrescoredPart> parts;
  std::vector<PrescoredFace> faces;  // ascending by (a, b)
};

// Breaks an asset into pieces "with constraints that shared faces coincide" [Jones et al. 2016, section 5], along cells
// that fill its box (prescoring_cells.h, splinter_cells.h). Tets are cut along the walls; what hangs together by faces
// within a cell is a part. New vertices take the weights, alpha and beta of where they lie in their tet, so that parts
// that lie against each other go on doing so in every pose in which they have the same example weights.
// Bones that do not act on a part are left out of it. Hulls: what is left of each of the asset's, with the corners of
// the cuts; cells are convex, so hulls of two parts do not overlap across a wall. The surface that is drawn is cut
// likewise, and closed on the walls: a closed surface along itself, an open one by the cut tets.
// Cuts leave crumbs; a part under `least_part`, or too flat for a hull, goes to the neighbour that it shares most area
// with (join_parts.h). Tets on the two sides of what was a wall between them have corners in common, but need not meet
// face to face. Errors: what validate rejects, no cell, neighbours that are not there, least_part out of range, cells
// that leave more than a millionth of the asset out.
Result<PrescoredAsset> prescored_parts(const sim::example_based::ExampleSet& asset,
                                       const std::vector<SplinterCell>& cells, const PrescoringOptions& options = {});

}  // namespace crumple::authoring
