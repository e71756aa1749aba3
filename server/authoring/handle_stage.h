#pragma once

#include "server/authoring/rig_pipeline.h"
#include "server/authoring/surface_transfer.h"

// The part of make_asset that makes handles and their weights.
namespace crumple::authoring {

// Whether the mesh brings joint weights.
bool is_painted(const ArtistMesh& mesh);

// Of the mesh, of the options, and automatic ones; the report counts them.
Result<RigHandles> all_handles(const ArtistMesh& mesh, const RigOptions& o, const sim::TetMesh& tets,
                               const std::vector<int>& surface, RigReport& report);

// N x B, by RigOptions::weights; with a tolerance, handles are added to the rig's. The set has its mesh and render.
// to_nodes: from the render surface to the tets.
Result<Eigen::MatrixXd> weights_of(const ArtistMesh& mesh, const RigOptions& o,
                                   const sim::example_based::ExampleSet& set, RigHandles& handles,
                                   const SurfaceTransfer& to_nodes, RigReport& report);

}  // namespace crumple::authoring
