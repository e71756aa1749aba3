#include "server/sim/fem/pressure_patch.h"

#include "server/sim/fem/edge_star.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/tet_faces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace crumple::sim::fem {
namespace {

constexpr int kNone = -1;
constexpr int kFewest = 4;  // tets around an edge that begin a patch
constexpr int kMost = 8;    // tets of a patch: connected by faces, at most 11 nodes (connectivity.h: kMaxCorners)

bool is_eligible(const RestBody& rest, int t) {
  return rest.material_of(t).poisson > kNearlyIncompressible;
}

bool may_join(const RestBody& rest, int s, int t) {
  return !rest.heterogeneous() || rest.material_id[s] == rest.material_id[t];
}

bool share_face(const Tet& s, const Tet& t) {
  return std::ranges::count_if(s, [&](int n) { return std::ranges::find(t, n) != t.end(); }) == 3;
}

// For each tet those that it shares a face with.
std::vector<std::vector<int>> face_neighbours(const std::vector<Tet>& tets) {
  std::vector<std::vector<int>> neighbours(tets.size());
  const std::vector<FaceOfTet> faces = sorted_faces(tets);
  for (std::size_t k = 1; k < faces.size(); ++k) {
    if (!faces[k].same_face(faces[k - 1])) continue;
    neighbours[faces[k].tet].push_back(faces[k - 1].tet);
    neighbours[faces[k - 1].tet].push_back(faces[k].tet);
  }
  return neighbours;
}

// Whether the tets hang together by faces and are of one material.
bool is_patch(const std::vector<Tet>& tets, const RestBody& rest, std::span<const int> star) {
  std::vector<int> parent(star.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (std::size_t a = 0; a < star.size(); ++a)
    for (std::size_t b = a + 1; b < star.size(); ++b)
      if (may_join(rest, star[a], star[b]) && share_face(tets[star[a]], tets[star[b]])) unite(parent, static_cast<int>(a), static_cast<int>(b));
  for (std::size_t a = 0; a < star.size(); ++a)
    if (find_root(parent, static_cast<int>(a)) != 0) return false;
  return true;
}

// Tets that are in no patch join the smallest one beside them; those that find none are patches of their own, which others may join.
void take_in_the_rest(const std::vector<Tet>& tets, const RestBody& rest, int count, std::vector<int>& of_tet) {
  const auto neighbours = face_neighbours(tets);
  std::vector<int> size(count, 0);
  for (const int p : of_tet)
    if (p != kNone) ++size[p];
  int lone = 0;  // all before it are in patches
  for (bool joined = true; std::exchange(joined, false);) {
    for (int t = lone; t < static_cast<int>(tets.size()); ++t) {
      if (of_tet[t] != kNone || !is_eligible(rest, t)) continue;
      int best = kNone;
      for (const int s : neighbours[t]) {
        const int p = of_tet[s];
        if (p == kNone || size[p] >= kMost || !may_join(rest, s, t)) continue;
        if (best == kNone || std::tie(size[p], p) < std::tie(size[best], best)) best = p;
      }
      if (best == kNone) continue;
      of_tet[t] = best;
      ++size[best];
      joined = true;
    }
    if (joined) continue;
    while (lone < static_cast<int>(tets.size()) && (of_tet[lone] != kNone || !is_eligible(rest, lone))) ++lone;
    if (lone == static_cast<int>(tets.size())) return;
    of_tet[lone] = static_cast<int>(size.size());
    size.push_back(1);
    joined = true;
  }
}

void append(const std::vector<Tet>& tets, const RestBody& rest, std::span<const int> members, PressurePatches& made) {
  double volume = 0;
  std::map<int, Vec3> core;
  for (const int t : members) {
    made.of_tet[t] = made.count();
    volume += rest.fill[t] * rest.volume[t];
    const Mat34 g = rest.gradients(t);
    for (int a = 0; a < 4; ++a) {  // of the true basis: V g_a is an area, however flat the tet
      const Vec3 term = -rest.fill[t] * rest.volume[t] * g.col(a);
      if (const auto [at, fresh] = core.try_emplace(tets[t][a], term); !fresh) at->second += term;
    }
  }
  made.tets.insert(made.tets.end(), members.begin(), members.end());
  const std::size_t first = made.core.size();
  Vec3 sum = Vec3::Zero();
  for (const auto& [node, c] : core) {
    made.nodes.push_back(node);
    made.core.push_back(c / std::sqrt(volume));
    if (made.core.size() > first + 1) sum += made.core.back();
  }
  made.core[first] = -sum;  // exactly: a translation strains nothing
  made.volume.push_back(volume);
  made.tet_start.push_back(static_cast<int>(made.tets.size()));
  made.corner_start.push_back(static_cast<int>(made.nodes.size()));
}

}  // namespace

void make_patches(const std::vector<Tet>& tets, RestBody& rest) {
  rest.patches = {};
  std::vector<int> of_tet(tets.size(), kNone);
  int count = 0;
  for (const EdgeStar& star : edge_stars_by_length(tets, rest, [&](int t) { return is_eligible(rest, t); })) {
    const int size = static_cast<int>(star.tets.size());
    if (size < kFewest || size > kMost || !is_patch(tets, rest, star.tets)) continue;
    if (std::ranges::any_of(star.tets, [&](int t) { return of_tet[t] != kNone; })) continue;
    for (const int t : star.tets) of_tet[t] = count;
    ++count;
  }
  take_in_the_rest(tets, rest, count, of_tet);
  if (std::ranges::all_of(of_tet, [](int p) { return p == kNone; })) return;
  rest.patches.of_tet = std::move(of_tet);
  regroup_patches(tets, rest);
}

void regroup_patches(const std::vector<Tet>& tets, RestBody& rest) {
  if (rest.patches.of_tet.empty()) {  // no patches, or the last tet has left
    rest.patches = {};
    return;
  }
  std::map<int, std::vector<int>> groups;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t)
    if (rest.patches.of_tet[t] != kNone) groups[rest.patches.of_tet[t]].push_back(t);
  PressurePatches made;
  made.of_tet.assign(tets.size(), kNone);
  made.tet_start = made.corner_start = {0};
  for (const auto& [patch, members] : groups) {
    std::vector<int> parent(members.size());
    std::iota(parent.begin(), parent.end(), 0);
    for (std::size_t a = 0; a < members.size(); ++a)
      for (std::size_t b = a + 1; b < members.size(); ++b)
        if (share_face(tets[members[a]], tets[members[b]])) unite(parent, static_cast<int>(a), static_cast<int>(b));
    for (int root = 0; root < static_cast<int>(members.size()); ++root) {
      if (find_root(parent, root) != root) continue;
      std::vector<int> part;
      for (int k = root; k < static_cast<int>(members.size()); ++k)
        if (find_root(parent, k) == root) part.push_back(members[k]);
      if (!std::ranges::all_of(part, [&](int t) { return rest.clamped(t); })) append(tets, rest, part, made);
    }
  }
  rest.patches = std::move(made);
}

}  // namespace crumple::sim::fem
