#include "server/sim/contact/detector.h"

#include <algorithm>
#include <functional>

// A piece against itself (self_contact.h says which of its tets may meet).
namespace crumple::sim::contact {
namespace {

// Of a piece that meets itself: two halves of it are the largest parts that can.
Share halves(const Unit& unit) { return {unit.mass / 4, unit.component->volume / 2}; }

}  // namespace

const SelfContact* Detector::self(const Unit& unit) const {
  return unit.mass < kInfinity ? in.bodies[unit.body].self : nullptr;
}

// A piece against itself, at the end of the step: the way there is not looked at, since what of it is fast is not known.
// Rows of two patches are a pair: friction in one place is not bounded by what presses in another.
void Detector::meet_itself(const Unit& unit, const ThreadPool& pool, std::vector<ContactRow>& rows) const {
  const SelfContact& body = *self(unit);
  const auto component = unit.component - in.bodies[unit.body].mesh->components.data();
  const int first = body.first_patch[component];
  const std::span patches(body.patches.data() + first, body.patches.data() + body.first_patch[component + 1]);
  // Lambdas below run on other threads, whose own these are not.
  thread_local std::vector<Box3> own_boxes;
  thread_local std::vector<IndexPair> own_pairs;
  thread_local std::vector<FoundRows> own_found;
  thread_local std::vector<std::size_t> ends;
  std::vector<Box3>& boxes = own_boxes;
  std::vector<IndexPair>& pairs = own_pairs;
  std::vector<FoundRows>& found = own_found;
  boxes.assign(patches.size(), Box3());
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (int k = patches[p].begin; k < patches[p].end; ++k) boxes[p].extend(unit.tet_boxes[body.tets[k] - unit.component->begin]);
  sweep_and_prune(boxes, pairs);
  for (int p = 0; p < static_cast<int>(patches.size()); ++p) pairs.emplace_back(p, p);
  std::erase_if(pairs, [&](const IndexPair& p) { return near_at_rest(patches[p.first], patches[p.second]); });

  if (found.size() < pairs.size()) found.resize(pairs.size());
  const auto meet_some = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      found[k].clear();
      meet_patches(unit, patches[pairs[k].first], patches[pairs[k].second], found[k]);
    }
  };
  pool.for_chunks(static_cast<int>(pairs.size()), 8, std::cref(meet_some));
  const std::span<const FoundRows> all(found.data(), pairs.size());
  const bool certain = std::ranges::any_of(all, &FoundRows::certain);
  ends.clear();
  for (const FoundRows& some : all) {
    const std::size_t before = rows.size();
    some.append_to(rows, certain);
    if (rows.size() > before) ends.push_back(rows.size());
  }
  share_out(halves(unit), rows);
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) rows[ends[k]].pair = 1;
}

void Detector::meet_patches(const Unit& unit, const SurfacePatch& a, const SurfacePatch& b, FoundRows& found) const {
  const SelfContact& body = *self(unit);
  const auto box = [&](int t) -> const Box3& { return unit.tet_boxes[t - unit.component->begin]; };
  for (int i = a.begin; i < a.end; ++i)
    for (int j = &a == &b ? i + 1 : b.begin; j < b.end; ++j) {
      const int s = std::min(body.tets[i], body.tets[j]), t = std::max(body.tets[i], body.tets[j]);
      if (!box(s).intersects(box(t)) || near_at_rest(body.balls[s], body.balls[t])) continue;
      const CollisionTet &tet_s = tet(unit, s), &tet_t = tet(unit, t);
      meet_tets(1, {unit, tet_s, orient(nodes(unit, tet_s))}, {unit, tet_t, orient(nodes(unit, tet_t))}, halves(unit), found);
    }
}

}  // namespace crumple::sim::contact
