#include "server/sim/fracture/mesh_split.h"

#include "server/sim/scatter.h"

#include <algorithm>

namespace crumple::sim::fracture {

namespace {

std::vector<SplitCandidate> in_random_order(std::span<const SplitCandidate> candidates, const SplitOptions& options) {
  std::vector<SplitCandidate> order(candidates.begin(), candidates.end());
  const std::uint64_t key = scatter(scatter(options.seed) ^ options.step);
  const auto rank = [&](int node) { return scatter(key ^ static_cast<std::uint64_t>(node)); };
  std::ranges::sort(order, {}, [&](const SplitCandidate& c) { return std::pair(rank(c.node), c.node); });
  return order;
}

}  // namespace

SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const SplitOptions& options) {
  const Toughness everywhere{.of_material = {std::numeric_limits<double>::infinity()}, .material_id = {}};
  return split_nodes(tets, state, stars, candidates, everywhere, options);
}

SplitReport split_nodes(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const Toughness& toughness,
                        const SplitOptions& options) {
  NodeSplitter splitter(tets, state, stars, toughness);
  for (const SplitCandidate& candidate : in_random_order(candidates, options)) {
    if (splitter.split_count() >= options.max_splits) break;
    splitter.split(candidate);
  }
  return splitter.report();
}

}  // namespace crumple::sim::fracture
