#include "server/sim/fem/macro_element.h"

#include "server/sim/fem/rest_body.h"
#include "server/sim/fem/smoothed_octahedron.h"

namespace crumple::sim::fem {

std::vector<int> regroup(const std::vector<Tet>& tets, RestBody& rest) {
  MacroElements& m = rest.macros;
  if (m.empty()) return {};
  const std::vector<int> of_tet = std::move(m.of_tet);
  if (m.cells.empty()) regroup_octahedra(tets, of_tet, rest);
  else regroup_cells(tets, of_tet, rest);
  std::vector<int> before(m.count());
  for (std::size_t slot = 0; slot < of_tet.size(); ++slot) before[m.of_tet[slot]] = of_tet[slot];
  return before;
}

std::vector<Mat3> inherited(const std::vector<Mat3>& plastic_strain, const std::vector<int>& before) {
  std::vector<Mat3> of_parts;
  if (plastic_strain.empty()) return of_parts;
  of_parts.reserve(before.size());
  for (const int d : before) of_parts.push_back(plastic_strain[d]);
  return of_parts;
}

}  // namespace crumple::sim::fem
