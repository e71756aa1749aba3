#include "server/sim/world_impl.h"

#include <algorithm>
#include <functional>
#include <utility>

// Rigid fragments of broken bodies in the solve (bodies/rigid_fragment.h), and how they get there.
namespace crumple::sim {

islands::IslandBody World::Impl::debris_for_islands(int body, double h) {
  const RigidFragment& fragment = fragment_of(body);
  if (fragment.is_held()) return {};
  islands::RigidPart part{.mass = fragment.mass(), .p_WC = fragment.com(), .inertia_W = fragment.inertia()};
  part.v = fragment.velocity();
  part.w = fragment.angular_velocity();
  const double share = h / scene.dt;  // of what was pushed in the step
  part.b_v = part.mass * (part.v + h * scene.gravity) + share * fragment.pushed();
  part.b_w = fragment.angular_momentum() + share * fragment.pushed_angular();
  return {.rigid = part, .in_solve = true};
}

void World::Impl::hand_over() {
  handed_over.resize(breakable.size());
  const auto part = [&](int k) { handed_over[k] = soft[breakable[k]].hand_over(pool); };
  pool.for_jobs(static_cast<int>(breakable.size()), std::cref(part));
  for (std::size_t k = 0; k < breakable.size(); ++k) {
    const int b = breakable[k];
    const SoftBody::HandOver moved = std::exchange(handed_over[k], {});
    if (moved.count == 0) continue;
    const int before = first_debris + static_cast<int>(debris.size());
    for (int own = static_cast<int>(soft[b].fragments.size()) - moved.count; own < static_cast<int>(soft[b].fragments.size()); ++own) {
      debris.push_back({b, own});
      sleepers.add_live();
      stillness.emplace_back();
      sleeping_box.emplace_back();
      disturbed.push_back(0);
    }
    follow_hand_over(b, moved, before);
  }
}

// Friction that is remembered has the new ids, of bodies, tets and nodes; that of what left is forgotten.
void World::Impl::follow_hand_over(int body, const SoftBody::HandOver& moved, int bodies_before) {
  std::vector<contact::FrictionMemory::Entry> kept;
  for (contact::FrictionMemory::Entry entry : friction.entries) {
    const bool on_plane = entry.key[1] >= bodies_before;
    bool left = false;
    for (int side = 0; side < 2; ++side) {
      int& id = entry.key[2 + side];
      if (entry.key[side] != body) continue;
      if (on_plane && !scene.contact.raw_damping) {  // rows of planes are of nodes
        left = left || moved.node[id].fragment >= 0;
        id = moved.node[id].node;
      } else {
        left = left || moved.tet[id] < 0;
        id = moved.tet[id];
      }
    }
    if (left) continue;
    if (on_plane) entry.key[1] += moved.count;
    kept.push_back(entry);
  }
  friction.entries = std::move(kept);
  contact::sort(friction);
}

}  // namespace crumple::sim
