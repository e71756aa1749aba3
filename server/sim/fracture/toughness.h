#pragma once

#include "server/sim/fem/rest_body.h"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace crumple::sim::fracture {

// From which stress on each tet of a body gives way.
struct Toughness {
  std::vector<double> of_material;             // [Pa]; [N] if raw; infinity: never
  std::span<const std::uint16_t> material_id;  // one a tet; empty: all of material 0
  bool raw = false;

  bool same_everywhere() const { return material_id.empty(); }
  double of(int t) const { return of_material[material_id.empty() ? 0 : material_id[t]]; }
  bool never_parts(int t) const { return of(t) == std::numeric_limits<double>::infinity(); }
};

// Refers to `rest`.
void toughness_of(const fem::RestBody& rest, Toughness& toughness);

}  // namespace crumple::sim::fracture
