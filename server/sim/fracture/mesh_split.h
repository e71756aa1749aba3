#pragma once

#include "server/sim/fracture/node_splitter.h"

#include <cstdint>

// The paper's order of splits (Parker & O'Brien 2009, section 5).
namespace crumple::sim::fracture {

struct SplitOptions {
  std::uint64_t seed = 1;  // with `step` it decides the order in which candidates are tried
  std::uint64_t step = 0;
  int max_splits = 200;  // candidates split in one call, at most
};

// Tries the candidates in an order that is random but set by seed, step and node ids alone, each by what it was before
// the call: there is no residual propagation and no update of nearby nodes (the paper's simplifications; crack_growth.h
// has both). What a split does: node_splitter.h.
SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const Toughness& toughness,
                        const SplitOptions& options);
// Of a body of one material.
SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const SplitOptions& options);

}  // namespace crumple::sim::fracture
