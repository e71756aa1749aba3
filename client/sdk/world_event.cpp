#include "client/sdk/world_event.h"

namespace crumple::client {

std::string to_string(EventKind kind) {
  switch (kind) {
    case EventKind::fracture: return "fracture";
    case EventKind::topology: return "topology";
    case EventKind::dent: return "dent";
    case EventKind::script: return "script";
    case EventKind::solver: return "solver";
    case EventKind::frozen: return "frozen";
    case EventKind::guard: return "guard";
    case EventKind::dust: return "dust";
    case EventKind::parted: return "parted";
    case EventKind::warning: return "warning";
  }
  return "unknown";
}

}  // namespace crumple::client
