#include "server/sim/event.h"

namespace crumple::sim {

const char* name(EventKind kind) {
  switch (kind) {  // no default: the compiler names a kind that is missing
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
  return "";
}

}  // namespace crumple::sim
