#pragma once

#include "server/sim/example_based/example_set.h"

#include <span>

namespace crumple::authoring {

// Where a vertex of a part lies in the asset that it was cut from.
struct PlaceInTet {
  int tet;
  Eigen::Vector4d weights;  // barycentric, >= 0
};
PlaceInTet place_in_tet(const sim::TetMesh& mesh, int tet, const Vec3& p);

// Gives a part, which has its mesh, what the asset has of a rig there: weights, alpha and beta, interpolated, the
// asset's examples, and the bones that act on it with their handles. places: one a vertex of the part. Returns these
// bones' ids in the asset, ascending.
std::vector<int> restrict_rig(const sim::example_based::ExampleSet& asset, std::span<const PlaceInTet> places,
                              sim::example_based::ExampleSet& part);

// Of each hull of the asset: its own vertices that the part has, and new ones between them and others; all of the part
// in one where that leaves nothing. No hull where the part is too flat.
void restrict_hulls(const sim::example_based::ExampleSet& asset, std::span<const PlaceInTet> places,
                    sim::example_based::ExampleSet& part);

}  // namespace crumple::authoring
