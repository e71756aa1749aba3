#pragma once

#include "server/sim/fem/elements.h"
#include "server/sim/fracture/mesh_split.h"

// The fracture stage of one body and one step (Parker & O'Brien 2009, section 5).
namespace crumple::sim::fracture {

// Sized on first use and when the mesh has grown.
struct FractureScratch {
  std::vector<Mat3> stress;    // Q sigma Q^T [Pa]
  std::vector<Mat34> normals;  // Q n_i, times fill [m^2]
  PartForces forces;
  std::vector<Mat3> S;         // separation tensors [N]; one a node of before the splits
  Toughness toughness;         // of the body's materials
  std::vector<SplitCandidate> candidates;
};

// Finds the nodes that are pulled apart by more than their material's toughness and splits them. Does nothing if no
// material of the body is breakable or `step` is no multiple of its fracture_interval. elements: those of `tets` at state.x, as
// update_elements or plastic_flow left them. stars: those of `tets`. After splits the caller must call
// fem::follow_topology and let its own arrays of nodes follow (extend_by_origin).
SplitReport fracture_step(const fem::RestBody& rest, const fem::Elements& elements, std::uint64_t seed,
                          std::uint64_t step, const ThreadPool& pool, std::vector<Tet>& tets, fem::FemState& state,
                          NodeStars& stars, FractureScratch& scratch);

}  // namespace crumple::sim::fracture
