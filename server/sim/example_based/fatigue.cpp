#include "server/sim/example_based/fatigue.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::example_based {

bool remember(const ExampleRest& rest, const ExampleParameters& parameters, double dt,
              std::span<const VertexImpulse> impulses, std::vector<SiteMemory>& memory, std::vector<VertexImpulse>& felt) {
  felt.assign(impulses.begin(), impulses.end());
  if (!(parameters.fatigue_time > 0)) {
    memory.clear();
    return false;
  }
  const auto beta_at = [&](int vertex) { return parameters.beta * rest.set->beta_scale_at(vertex); };
  const double fade = std::exp(-dt / parameters.fatigue_time);
  for (SiteMemory& site : memory) site.impulse *= fade;

  bool grows = false;
  for (VertexImpulse& at : felt) {
    if (!at.impulse.allFinite() || at.impulse.isZero(0)) continue;
    const double beta = beta_at(at.vertex);
    grows |= at.impulse.norm() > (1 - fade) * beta;
    auto site = std::ranges::lower_bound(memory, at.vertex, {}, &SiteMemory::vertex);
    if (site == memory.end() || site->vertex != at.vertex) site = memory.insert(site, {at.vertex, Vec3::Zero()});
    at.impulse += site->impulse;
    const double norm = at.impulse.norm();
    site->impulse = norm > beta ? Vec3(beta / norm * at.impulse) : at.impulse;
  }
  std::erase_if(memory, [&](const SiteMemory& site) { return site.impulse.norm() <= kForgotten * beta_at(site.vertex); });
  return grows;
}

}  // namespace crumple::sim::example_based
