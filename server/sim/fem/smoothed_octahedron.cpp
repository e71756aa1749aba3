#include "server/sim/fem/smoothed_octahedron.h"

#include "server/sim/fem/edge_star.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/mesh/disjoint_sets.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crumple::sim::fem {
namespace {

constexpr std::size_t kMostAround = 24;  // tets; around an edge of more each stays alone (connectivity.h: kMaxCorners)

// One of the two edges that a tet gives half of itself to.
struct Slot {
  std::array<int, 2> edge;  // ascending
  int slot;                 // 2 tet + which of its two
  auto operator<=>(const Slot&) const = default;
};

struct Group {
  std::array<int, 2> edge;
  std::vector<int> slots;    // ascending
  std::vector<int> corners;  // node ids
  bool closed = false;
};

std::array<int, 2> edge_of(const Tet& tet, const std::uint8_t pairing, int which) {
  const auto& local = kPairings[pairing][which];
  const auto [low, high] = std::minmax(tet[local[0]], tet[local[1]]);
  return {low, high};
}

bool may_join(const RestBody& rest, int s, int t) {
  return !rest.clamped(s) && !rest.clamped(t) && (!rest.heterogeneous() || rest.material_id[s] == rest.material_id[t]);
}

// Puts the slots of a group in order around the edge if they close, and says whether they do; lists the corners.
void arrange(const std::vector<Tet>& tets, Group& group) {
  const auto of = [&](int slot) { return around(tets[slot / 2], group.edge); };
  const std::size_t count = group.slots.size();
  group.corners = {group.edge[0], group.edge[1]};
  if (count == 4) {
    std::vector<int> ring{group.slots.front()};
    while (ring.size() < count) {
      const int last = of(ring.back())[1];
      const auto next = std::ranges::find_if(group.slots, [&](int s) { return of(s)[0] == last && s != ring.front(); });
      if (next == group.slots.end()) break;
      ring.push_back(*next);
    }
    group.closed = ring.size() == count && of(ring.back())[1] == of(ring.front())[0];
    for (std::size_t k = 0; group.closed && k < count; ++k) {
      for (std::size_t m = k + 1; m < count; ++m) group.closed = group.closed && of(ring[k])[0] != of(ring[m])[0];
    }
    if (group.closed) {
      group.slots = ring;
      for (const int slot : ring) group.corners.push_back(of(slot)[0]);
      return;
    }
  }
  for (const int slot : group.slots)
    for (const int n : of(slot)) group.corners.push_back(n);
  std::sort(group.corners.begin() + 2, group.corners.end());
  group.corners.erase(std::unique(group.corners.begin() + 2, group.corners.end()), group.corners.end());
}

// Of the slots of one edge, those that hang together by faces. before: of each slot, the octahedron that it was in; what was
// in two stays in two. Empty: nothing was.
void add_groups(const std::vector<Tet>& tets, const RestBody& rest, std::span<const Slot> slots, std::span<const int> before,
                std::vector<Group>& groups) {
  std::vector<int> parent(slots.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (std::size_t a = 0; a < slots.size(); ++a) {
    for (std::size_t b = a + 1; b < slots.size(); ++b) {
      const int s = slots[a].slot / 2, t = slots[b].slot / 2;
      const auto p = around(tets[s], slots[a].edge), q = around(tets[t], slots[b].edge);
      if (!before.empty() && before[slots[a].slot] != before[slots[b].slot]) continue;
      const bool share_face = p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1];
      if (share_face && may_join(rest, s, t) && slots.size() <= kMostAround) unite(parent, static_cast<int>(a), static_cast<int>(b));
    }
  }
  for (std::size_t root = 0; root < slots.size(); ++root) {
    if (find_root(parent, static_cast<int>(root)) != static_cast<int>(root)) continue;
    Group group{.edge = slots[root].edge, .slots = {}, .corners = {}};
    for (std::size_t k = root; k < slots.size(); ++k)
      if (find_root(parent, static_cast<int>(k)) == static_cast<int>(root)) group.slots.push_back(slots[k].slot);
    arrange(tets, group);
    groups.push_back(std::move(group));
  }
}

void append(const std::vector<Tet>& tets, const RestBody& rest, const Group& group, MacroElements& o) {
  const int first = static_cast<int>(o.nodes.size()), n = static_cast<int>(group.corners.size());
  double volume = 0;
  for (const int slot : group.slots) volume += 0.5 * rest.fill[slot / 2] * rest.volume[slot / 2];
  o.nodes.insert(o.nodes.end(), group.corners.begin(), group.corners.end());
  o.core.resize(first + n, Vec3::Zero());
  std::vector<Vec3> X(n);  // from the first end
  const auto corner_of = [&](int node) { return static_cast<int>(std::ranges::find(group.corners, node) - group.corners.begin()); };
  for (const int slot : group.slots) {
    const int t = slot / 2;
    o.of_tet[slot] = o.count();
    o.tets.push_back(t);
    const Mat34 local = rest_nodes(rest, t), core = rest.core(t);
    const Vec3 end = local.col(static_cast<int>(std::ranges::find(tets[t], group.edge[0]) - tets[t].begin()));
    for (int a = 0; a < 4; ++a) {
      const int at = corner_of(tets[t][a]);
      o.core[first + at] += 0.5 * std::sqrt(rest.fill[t] * rest.volume[t] / volume) * core.col(a);
      X[at] = local.col(a) - end;
    }
  }
  // Sum to zero exactly: a translation strains nothing.
  o.core[first].setZero();
  for (int a = 1; a < n; ++a) o.core[first] -= o.core[first + a];

  Vec3 middle = Vec3::Zero();
  std::vector<double> h(n);
  for (int a = 0; a < n; ++a) {
    h[a] = a < 2 ? 0.5 : -1.0 / (n - 2);
    middle += h[a] * X[a];
  }
  o.gamma.resize(first + n);
  const double to_gradient = -1 / std::sqrt(volume);
  // Two lattices that slide by s strain plain tets, whose edges are h / 2 from each other, by 2 s / h.
  const double mu = rest.lame_of(group.slots.front() / 2).mu;
  const double root = n > 4 ? std::sqrt(kHourglassShare * volume * 2 * mu * 4 / X[1].squaredNorm()) : 0;
  for (int a = 0; a < n; ++a) o.gamma[first + a] = root * (h[a] - to_gradient * o.core[first + a].dot(middle));
  o.volume.push_back(volume);
  o.tet_start.push_back(static_cast<int>(o.tets.size()));
  o.corner_start.push_back(static_cast<int>(o.nodes.size()));
}

void group_tets(const std::vector<Tet>& tets, std::span<const int> before, RestBody& rest) {
  MacroElements& o = rest.macros;
  std::vector<Slot> slots;
  slots.reserve(2 * tets.size());
  for (int t = 0; t < static_cast<int>(tets.size()); ++t)
    for (int k = 0; k < 2; ++k) slots.push_back({edge_of(tets[t], o.pairing[t], k), 2 * t + k});
  std::ranges::sort(slots);
  std::vector<Group> groups;
  groups.reserve(slots.size() / 3);
  for (auto begin = slots.begin(); begin != slots.end();) {
    const auto end = std::find_if(begin, slots.end(), [&](const Slot& s) { return s.edge != begin->edge; });
    add_groups(tets, rest, {begin, end}, before, groups);
    begin = end;
  }
  MacroElements made;
  made.pairing = std::move(o.pairing);
  made.of_tet.resize(slots.size());
  made.tet_start = made.corner_start = {0};
  for (const bool closed : {true, false}) {
    for (const Group& group : groups)
      if (group.closed == closed) append(tets, rest, group, made);
    if (closed) made.closed = made.count();
  }
  o = std::move(made);
}

}  // namespace

void make_octahedra(const std::vector<Tet>& tets, RestBody& rest) {
  MacroElements& o = rest.macros;
  o.pairing.clear();
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    const Mat34 X = rest_nodes(rest, t);
    int best = 0;
    double longest = 0;
    for (int p = 0; p < 3; ++p) {
      double length = 0;
      for (const auto& edge : kPairings[p]) length += (X.col(edge[0]) - X.col(edge[1])).norm();
      if (length > (1 + 1e-9) * longest) best = p, longest = length;
    }
    o.pairing.push_back(static_cast<std::uint8_t>(best));
  }
  group_tets(tets, {}, rest);
}

void regroup_octahedra(const std::vector<Tet>& tets, std::span<const int> before, RestBody& rest) { group_tets(tets, before, rest); }

}  // namespace crumple::sim::fem
