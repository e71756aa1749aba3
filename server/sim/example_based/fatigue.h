#pragma once

#include "server/sim/example_based/example_state.h"

#include <span>
#include <vector>

// Many small impulses, and loads that last: "would require enhancing our plasticity model to handle creep and perhaps a
// different approach to the plastic yield condition in Equation (4)" (Jones et al. 2016, section 6). Ours: a vertex remembers
// the impulses below beta that act on it, as a vector, and forgets them by 1/e in fatigue_time. Eq. 4 sees an impulse together
// with what is remembered; what then exceeds beta is plastic, and beta remains in memory.
//   Blows j in equal intervals T dent from their n-th on, sum_{k < n} |j| e^(-k T / fatigue_time) > beta, or never if all of
//   them do not reach it. A load F that lasts creeps where F fatigue_time > beta, and then as fast as impulses of
//   F - beta / fatigue_time a second dent. Neither depends on dt; blows from opposite sides undo each other.
// So that weight alone does not dent a body, fatigue_time must be below beta / (m |g|).
namespace crumple::sim::example_based {

// What is remembered is forgotten below this part of beta.
inline constexpr double kForgotten = 1e-6;

struct VertexImpulse {
  int vertex = 0;
  Vec3 impulse = Vec3::Zero();  // j_i [N s] in the asset's axes
  double share = 1;             // part of the plastic displacement that acts at this vertex; see impulse_site.h
};

// `impulses`, each with what its vertex remembers, into `felt`; both of a step of length dt [s]. Impulses that are not finite
// stay as they are and are not remembered. With fatigue_time = 0 everything is forgotten and `felt` is `impulses`. Returns
// whether some impulse, if it came in every step from now on, would in the end exceed beta: the body is then not at rest.
bool remember(const ExampleRest& rest, const ExampleParameters& parameters, double dt,
              std::span<const VertexImpulse> impulses, std::vector<SiteMemory>& memory, std::vector<VertexImpulse>& felt);

}  // namespace crumple::sim::example_based
