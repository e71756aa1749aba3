#pragma once

#include "common/error.h"
#include "common/types.h"
#include "server/sim/example_based/example_set.h"

#include <optional>
#include <string>
#include <variant>
#include <vector>

// What a client may do to a running world.
namespace crumple::sim {

inline constexpr double kMaxForce = 1e12;     // [N]
inline constexpr double kMaxImpulse = 1e9;    // [N s]
inline constexpr double kMaxPosition = 1e6;   // [m]

// Impulse at a point. Rigid and example-based bodies: at that point of the body (dents it, too). Finite-element
// bodies: spread over the nodes within `radius` of the point by a smooth kernel, or on the nearest node if none is.
struct ApplyImpulse {
  BodyId body = 0;
  Vec3 impulse = Vec3::Zero();  // in W [N s], |.| <= kMaxImpulse
  Vec3 point = Vec3::Zero();    // in W [m]
  double radius = 0.1;          // [m], 0 <= radius <= kMaxPosition
};

// The same with a force that acts for `duration`; each step gets force * dt.
struct ApplyForce {
  BodyId body = 0;
  Vec3 force = Vec3::Zero();    // in W [N], |.| <= kMaxForce
  Vec3 point = Vec3::Zero();    // in W [m]
  double radius = 0.1;          // [m], 0 <= radius <= kMaxPosition
  double duration = 0;          // [s], 0: one step; at most 1e9
};

// Finite-element bodies: an impulse on a region given by node ids, shared by mass.
struct ApplyNodeImpulse {
  BodyId body = 0;
  std::vector<int> nodes;       // one at least
  Vec3 impulse = Vec3::Zero();  // in W [N s], |.| <= kMaxImpulse
};

// Example-based bodies: parameters of Jones et al. 2016, section 4, and options beyond it, from this step on; what is empty
// stays. Limits as of ExampleParameters.
struct SetExampleParameters {
  BodyId body = 0;
  std::optional<double> alpha, beta, gamma, lambda, mu, nu, restitution;
  std::optional<example_based::ExampleParameters::SecondaryGoal> secondary_goal;
  std::optional<double> goal_tolerance;
  std::optional<bool> keep_volume;
  std::optional<double> fatigue_time;
};

using Command = std::variant<ApplyImpulse, ApplyForce, ApplyNodeImpulse, SetExampleParameters>;

// Every number finite and within its limit, node lists not empty. Whether body and nodes exist is for the caller.
// `field` prefixes the error's path.
Result<void> validate(const Command& command, const std::string& field);

struct ScriptedCommand {
  double time = 0;  // applied at the first step whose start is at or after it [s], [0, 1e9]
  Command command;
};

}  // namespace crumple::sim
