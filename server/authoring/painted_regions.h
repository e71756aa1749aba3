#pragma once

#include "common/types.h"

// Weak and strong regions as vertex colours: red scales alpha, how much an impulse deforms (Jones et al. 2016, eq. 8);
// blue scales beta, the impulse below which nothing does (eq. 4). Green means nothing. Of a linear channel c in [0, 1]
//   scale = 2^(4 (2 c - 1)),
// so that half grey changes nothing, black is a sixteenth and white is sixteen times.
namespace crumple::authoring {

double region_scale(double channel);

// The channel of a scale; what lies outside [1/16, 16] ends at 0 or 1.
double region_channel(double scale);

}  // namespace crumple::authoring
