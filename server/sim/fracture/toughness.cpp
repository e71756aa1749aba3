#include "server/sim/fracture/toughness.h"

namespace crumple::sim::fracture {

Toughness toughness_of(const fem::RestBody& rest) {
  Toughness toughness{.of_material = {}, .material_id = rest.material_id, .raw = rest.material.raw_toughness};
  for (int k = 0; k < rest.material_count(); ++k) {
    const fem::FemMaterial& m = rest.material_at(k);
    toughness.of_material.push_back(m.breakable ? m.toughness : std::numeric_limits<double>::infinity());
  }
  return toughness;
}

}  // namespace crumple::sim::fracture
