#include "server/sim/fracture/fracture_step.h"

#include "server/sim/fracture/crack_growth.h"

#include <cassert>
#include <functional>

namespace crumple::sim::fracture {

SplitReport fracture_step(const fem::RestBody& rest, const fem::Elements& elements, std::uint64_t seed,
                          std::uint64_t step, const ThreadPool& pool, std::vector<Tet>& tets, fem::FemState& state,
                          NodeStars& stars, FractureScratch& scratch) {
  const fem::FemMaterial& material = rest.material;
  assert(material.fracture_interval >= 1);
  if (!rest.breakable() || step % material.fracture_interval != 0) return {};

  const int tet_count = static_cast<int>(tets.size());
  assert(elements.is_of(rest) && rest.tet_count() == tet_count);
  scratch.stress.resize(tet_count);
  scratch.normals.resize(tet_count);
  const auto load = [&](int begin, int end) {
    for (int t = begin; t < end; ++t) {
      scratch.stress[t] = fem::element_stress(rest, elements, t);
      scratch.normals[t] = fem::element_normals(rest, elements, t);
    }
  };
  pool.for_chunks(tet_count, 256, std::cref(load));
  scratch.S.resize(stars.node_count());
  separation_tensors(tets, stars, scratch.stress, scratch.normals, pool, scratch.forces, scratch.S);
  toughness_of(rest, scratch.toughness);
  const std::vector<SplitCandidate>& candidates = scratch.candidates;
  split_candidates(tets, stars, scratch.normals, scratch.forces, scratch.S, scratch.toughness, pool, scratch.candidates);
  if (material.fracture_order == fem::FractureOrder::largest_first)
    return grow_cracks(tets, state, stars, candidates, scratch.toughness, scratch.normals, material.max_splits_per_step,
                       scratch.stress, scratch.forces);
  return split_nodes(tets, state, stars, candidates, scratch.toughness,
                     {.seed = seed, .step = step, .max_splits = material.max_splits_per_step});
}

}  // namespace crumple::sim::fracture
