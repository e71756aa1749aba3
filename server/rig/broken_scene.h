#pragma once

#include "server/authoring/prescored_parts.h"
#include "server/rig/scene_messages.h"

#include <array>

namespace crumple::rig {

struct BrokenSceneOptions {
  double strength = 0;   // tension that the faces between parts bear [Pa]; 0: default_strength
  double density = kAssetDensity;  // [kg/m^3]
  bool struck = true;    // by a ball that flies along x into its upper half
};

// Linear RGB, so that one sees what came apart.
std::array<float, 3> part_colour(std::size_t part);

// The tension that joints get where options.strength is 0 [Pa]: 100 times the pressure at the foot of a column as high
// as the asset's longest side, so that it carries itself and breaks under the ball.
double default_strength(const authoring::PrescoredAsset& asset, double density);

// A scene (JSON of crumple.v1.Scene) in which an asset's parts stand on the ground as bodies of their own, asleep, held
// together where their faces meet (Jones et al. 2016, section 5). A face of area A bears strength * A [N] and, as a
// square beam's section in bending, strength * A^1.5 / 6 [N m]; one under a tenth of the mean counts as a tenth. files:
// of the parts' assets, as the scene names them. Errors: strength or density out of range.
Result<std::string> broken_scene(const authoring::PrescoredAsset& asset, const std::vector<std::string>& files,
                                 const std::string& name, const BrokenSceneOptions& options);

}  // namespace crumple::rig
