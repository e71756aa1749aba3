#include "server/sim/command.h"

#include "server/sim/limits.h"

namespace crumple::sim {
namespace {

void check(FirstBreach& breach, const ApplyImpulse& c, const std::string& at) {
  breach.vector(c.impulse, kMaxImpulse, at + "impulse");
  breach.vector(c.point, kMaxPosition, at + "point");
  breach.number(c.radius, limits::kRadius, at + "radius");
}

void check(FirstBreach& breach, const ApplyForce& c, const std::string& at) {
  breach.vector(c.force, kMaxForce, at + "force");
  breach.vector(c.point, kMaxPosition, at + "point");
  breach.number(c.radius, limits::kRadius, at + "radius");
  breach.number(c.duration, limits::kTime, at + "duration");
}

void check(FirstBreach& breach, const ApplyNodeImpulse& c, const std::string& at) {
  breach.vector(c.impulse, kMaxImpulse, at + "impulse");
  breach.require(!c.nodes.empty(), at + "nodes", "is empty, must name one node at least");
}

void check(FirstBreach& breach, const SetExampleParameters& c, const std::string& at) {
  const auto number = [&](const std::optional<double>& value, const Range& range, const char* name) {
    if (value) breach.number(*value, range, at + name);
  };
  number(c.alpha, limits::kAlpha, "alpha");
  number(c.beta, limits::kBeta, "beta");
  number(c.gamma, limits::kGamma, "gamma");
  number(c.lambda, limits::kLambda, "lambda");
  number(c.mu, limits::kRestitutionRate, "mu");
  number(c.nu, limits::kRestitutionRate, "nu");
  number(c.restitution, limits::kUnit, "restitution");
  number(c.goal_tolerance, limits::kGoalTolerance, "goal_tolerance");
  number(c.fatigue_time, limits::kFatigueTime, "fatigue_time");
}

}  // namespace

Result<void> validate(const Command& command, const std::string& field) {
  FirstBreach breach;
  const std::string at = field.empty() ? "" : field + ".";
  std::visit([&](const auto& c) { check(breach, c, at); }, command);
  return breach.result();
}

}  // namespace crumple::sim
