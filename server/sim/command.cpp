#include "server/sim/command.h"

#include "server/sim/limits.h"

namespace crumple::sim {
namespace {

void check(FirstBreach& breach, const ApplyImpulse& c, const std::string& field) {
  breach.vector(c.impulse, kMaxImpulse, field + ".impulse");
  breach.vector(c.point, kMaxPosition, field + ".point");
  breach.number(c.radius, limits::kRadius, field + ".radius");
}

void check(FirstBreach& breach, const ApplyForce& c, const std::string& field) {
  breach.vector(c.force, kMaxForce, field + ".force");
  breach.vector(c.point, kMaxPosition, field + ".point");
  breach.number(c.radius, limits::kRadius, field + ".radius");
  breach.number(c.duration, limits::kTime, field + ".duration");
}

void check(FirstBreach& breach, const ApplyNodeImpulse& c, const std::string& field) {
  breach.vector(c.impulse, kMaxImpulse, field + ".impulse");
  breach.require(!c.nodes.empty(), field + ".nodes", "is empty, must name one node at least");
}

}  // namespace

Result<void> validate(const Command& command, const std::string& field) {
  FirstBreach breach;
  std::visit([&](const auto& c) { check(breach, c, field); }, command);
  return breach.result();
}

}  // namespace crumple::sim
