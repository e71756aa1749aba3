#pragma once

#include "common/error.h"
#include "common/types.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <vector>

// The three steps that Jones et al. 2016, section 3.2.1 offer for an impulse, on one scene: along the gradient (eq. 8),
// by the pseudo-inverse (eq. 9), by the largest component (eq. 10).
namespace crumple::lab {

struct StepComparison {
  std::filesystem::path scene;         // a scene file with example-based bodies
  std::vector<double> times{1, 2};     // of a row of the picture each [s], ascending, (0, 60]
  std::vector<double> alphas;          // of eq. 8 [1/m], 9 [-], 10 [1/m^2], instead of the scene's; three or none
  Vec3 from = Vec3(-0.62, 0.42, 0.9);  // where the camera stands, seen from the bodies
  std::filesystem::path picture;       // .png
};

// Steps the scene once with each option for all its example-based bodies, and writes the picture: a column an option, a
// row a time, vertices in the colours of the examples that they have; each row's camera holds the bodies of all three.
// Returns
// {"equation8": {body: {"weight_largest", "weight_mean"}}, "equation9": ..., "equation10": ...}, of 1 minus the rest
// pose's weight over the vertices at the end. Errors: load_scene's; no example-based body; times, alphas or picture,
// see above; what sim::validate rejects.
Result<nlohmann::json> compare_steps(const StepComparison& comparison);

}  // namespace crumple::lab
