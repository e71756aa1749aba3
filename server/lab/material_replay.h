#pragma once

#include "server/lab/yardstick_case.h"

#include <map>
#include <optional>

namespace crumple::lab {

struct ReplayReport {
  double max_relative_error = 0;
  std::map<std::string, double> by_test;
  // Where case.json has a j2_check: the deviatoric rule's shear stresses against CalculiX's *PLASTIC, of which seven
  // digits are stored; not part of max_relative_error.
  std::optional<double> j2_calculix;
};

// Replays a material case: paths.json (strain path -> plastic strain and stress after each update, raw per-update
// creep) or states.json (F -> Q, strain, stress, P, energy density). The error of an array is
// max |got - ref| / max(max |ref|, floor), floor 1e-3 for strains, 1e-3 E for stresses, 1 for Q, 1e-6 E for energy.
// Where case.json has scalars.j2_check_pure_shear_c1, both flow rules also go through its cycle, pure shear with c = 1
// far beyond yield, back and forth again, and have to end each leg at its `additive_tau`: in pure shear the paper's rule
// and von Mises' are one. by_test has them as "j2_check additive" and "j2_check deviatoric".
Result<ReplayReport> replay_material(const std::filesystem::path& case_dir);

}  // namespace crumple::lab
