#pragma once

#include "server/authoring/prescored_parts.h"

#include <string>

namespace crumple::rig {

// Two views of a prescored asset: whole, each part in its own colour, and with its parts drawn apart.
std::string parts_png(const authoring::PrescoredAsset& asset);
std::string parts_svg(const authoring::PrescoredAsset& asset);

}  // namespace crumple::rig
