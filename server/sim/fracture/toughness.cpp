#include "server/sim/fracture/toughness.h"

namespace crumple::sim::fracture {

void toughness_of(const fem::RestBody& rest, Toughness& toughness) {
  toughness.of_material.clear();
  toughness.material_id = rest.material_id;
  toughness.raw = rest.material.raw_toughness;
  for (int k = 0; k < rest.material_count(); ++k) {
    const fem::FemMaterial& m = rest.material_at(k);
    toughness.of_material.push_back(m.breakable ? m.toughness : std::numeric_limits<double>::infinity());
  }
}

}  // namespace crumple::sim::fracture
