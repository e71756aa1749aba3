#include "server/sim/bodies/soft_body.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim {

// Parker & O'Brien 2009, section 5, at the positions that the step has just reached.
FractureOutcome SoftBody::fracture(std::uint64_t seed, std::uint64_t step, const ThreadPool& pool) {
  const fem::FemMaterial& m = material();
  if (frozen || !m.breakable || step % m.fracture_interval != 0) return {.fragments = last_fragments_};

  // A yielding material's flow has left the elements at these positions already.
  if (!std::isfinite(m.yield)) {
    fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
  }
  const std::uint64_t own_seed = seed ^ (0x9e3779b97f4a7c15ULL * (id + 1));  // bodies break in different orders
  const fracture::SplitReport report =
      fracture::fracture_step(rest, system.elements, own_seed, step, pool, tets, state, stars_, fracture_scratch_);
  if (report.splits.empty()) return {.fragments = last_fragments_};

  fracture::extend_by_origin(X, report.origin);
  fracture::extend_by_origin(fixed, report.origin);
  changed_while_prescribed_ = true;
  for (DrivenNodes& driven : driven_) {
    const std::vector<int> before = driven.motion.nodes;
    for (std::size_t k = 0; k < report.origin.size(); ++k) {
      const auto at = std::find(before.begin(), before.end(), report.origin[k]);
      if (at == before.end()) continue;
      driven.motion.nodes.push_back(node_count() - static_cast<int>(report.origin.size()) + static_cast<int>(k));
      driven.at_start.push_back(driven.at_start[at - before.begin()]);
    }
  }
  fem::update_node_mass(rest, tets, node_count());
  topology_changed();
  last_fragments_ = report.fragments;

  FractureOutcome outcome{.splits = static_cast<int>(report.splits.size()), .fragments = report.fragments};
  outcome.point = report.splits.front().point;
  return outcome;
}

}  // namespace crumple::sim
