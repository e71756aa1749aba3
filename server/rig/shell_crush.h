#pragma once

#include "server/rig/crush.h"

namespace crumple::rig {

// An example from a mass-spring thin shell (Jones et al. 2016, section 5, figure 5; thin_shell.h): the skin of the tets
// that `crush` would press is crushed between the same plates, which hold what they touch, and springs back. It is
// hollow, so that it buckles and folds where a solid swells; the render surface follows the shell's nearest triangles.
// Of the report, plastic_strain is the largest change of a fold's rest length, and no tet is inverted: there are none.
// Deterministic. Errors: crush's.
Result<Crushed> shell_crush(const sim::example_based::ExampleSet& set, const std::string& name,
                            const CrushOptions& options, const std::function<void(double done)>& progress = {});

}  // namespace crumple::rig
