#pragma once

#include "crumple/v1/simulation.pb.h"
#include "server/sim/event.h"

namespace crumple::scene_convert {

// An event as the stream and a recording carry it.
v1::Event to_message(const sim::Event& event);

}  // namespace crumple::scene_convert
