#pragma once

#include "server/authoring/prescored_parts.h"

namespace crumple::authoring {

// Parts under `least` [m^3], and those too flat for a hull, go to the part that they share most area with, the smallest
// first, until none is left that has a neighbour; faces are those of what remains. A part that took others has the
// `cell` of its largest.
PrescoredAsset with_small_parts_joined(PrescoredAsset asset, double least);

}  // namespace crumple::authoring
