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

void World::Impl::add_part(const Piece& piece) {
  const Part part = part_count();
  broken_off.push_back(piece);
  sleepers.add_live();
  stillness.emplace_back();
  sleeping_box.emplace_back();
  disturbed.push_back(0);
  if (piece.is_rigid()) {
    debris.push_back(part);
  } else {
    soft_parts.push_back(part);
    if (soft[piece.soft].is_kinematic()) sleepers.set_kinematic(part);
  }
}

void World::Impl::hand_over() {
  handed_over.resize(breakable.size());
  const auto part = [&](int k) { handed_over[k] = soft[breakable[k]].hand_over(pool); };
  pool.for_jobs(static_cast<int>(breakable.size()), std::cref(part));
  for (std::size_t k = 0; k < breakable.size(); ++k) {
    const int b = breakable[k];
    SoftBody::HandOver moved = std::exchange(handed_over[k], {});
    if (moved.count() == 0) continue;
    const int soft_before = static_cast<int>(soft.size()), others = first_debris - soft_at_detection;
    const int bodies_before = soft_before + others + static_cast<int>(debris.size());
    std::vector<Piece> left;
    const int first_fragment = static_cast<int>(soft[b].fragments.size()) - moved.fragments;
    for (int own = 0; own < moved.fragments; ++own) left.push_back({b, first_fragment + own});
    for (SoftBody& mesh : moved.meshes) {
      left.push_back({static_cast<int>(soft.size())});
      soft.push_back(std::move(mesh));
      guards.push_back(guards[b]);
      was_capped.push_back(was_capped[b]);
      for (IslandAccount& account : accounts)
        if (std::ranges::find(account.soft, b) != account.soft.end()) account.soft.push_back(left.back().soft);
    }
    FemObject& object = objects[places[soft[b].id].index];
    for (std::size_t m = 0; m < moved.meshes.size(); ++m) {
      soft[soft_before + m].piece = static_cast<int>(object.pieces().size() + moved.fragments + m);
    }
    object.follow(soft[b], moved, left);
    for (const Piece& piece : left) add_part(piece);
    if (soft[b].is_kinematic()) sleepers.set_kinematic(part_of(soft[b]));
    follow_hand_over(b, moved, soft_before, bodies_before);
  }
}

// Friction that is remembered has the new ids, of bodies, tets and nodes. What of it was of rigid fragments that left, or would
// change sides with its bodies, is forgotten.
void World::Impl::follow_hand_over(int body, const SoftBody::HandOver& moved, int soft_before, int bodies_before) {
  const int new_meshes = static_cast<int>(moved.meshes.size());
  std::vector<contact::FrictionMemory::Entry> kept;
  for (contact::FrictionMemory::Entry entry : friction.entries) {
    const bool on_plane = entry.key[1] >= bodies_before;
    const bool of_nodes = on_plane && !scene.contact.raw_damping;  // rows of planes are
    bool left = false;
    for (int side = 0; side < 2; ++side) {
      int &own = entry.key[side], &id = entry.key[2 + side];
      if (own == body) {
        const int piece = of_nodes ? moved.node[id].piece : moved.tet[id].piece;
        id = of_nodes ? moved.node[id].node : moved.tet[id].tet;
        left = left || (piece >= 0 && piece < moved.fragments);
        if (piece >= moved.fragments) own = soft_before + piece - moved.fragments;
      } else if (own >= soft_before) {
        own += new_meshes;
        if (side == 1 && on_plane) own += moved.fragments;
      }
    }
    if (!left && entry.key[0] <= entry.key[1]) kept.push_back(entry);
  }
  friction.entries = std::move(kept);
  friction.make_index();
}

}  // namespace crumple::sim
