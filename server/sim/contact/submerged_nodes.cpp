#include "server/sim/contact/submerged_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace crumple::sim::contact {
namespace {

struct Share {
  int node, order;  // sums are of tets in theirs
  double area, volume;
};

// What one tet adds to its four nodes.
void add_shares(const CollisionTet& tet, std::span<const Vec3> x, const Vec3& normal, std::vector<Share>& shares) {
  const std::array<Vec3, 4> p{x[tet.nodes[0]], x[tet.nodes[1]], x[tet.nodes[2]], x[tet.nodes[3]]};
  const double volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6;
  if (volume == 0) return;
  std::array<double, 4> area{};
  for (int k = 0; k < 4; ++k) {
    if (!(tet.exterior >> k & 1)) continue;
    const int a = (k + 1) & 3, b = (k + 2) & 3, c = (k + 3) & 3;
    Vec3 outward = 0.5 * (p[b] - p[a]).cross(p[c] - p[a]);
    if (outward.dot(p[k] - p[a]) > 0) outward = -outward;
    const double facing = std::max(0.0, -normal.dot(outward)) / 3;
    for (const int corner : {a, b, c}) area[corner] += facing;
  }
  for (int k = 0; k < 4; ++k) shares.push_back({tet.nodes[k], static_cast<int>(shares.size()), area[k], std::abs(volume) / 4});
}

}  // namespace

std::span<const SubmergedNode> submerged_nodes(std::span<const CollisionTet> tets, std::span<const Vec3> x, const Vec3& normal,
                                               double offset) {
  const auto depth = [&](int node) { return offset - normal.dot(x[node]); };
  thread_local std::vector<Share> shares;
  thread_local std::vector<SubmergedNode> nodes;
  shares.clear();
  nodes.clear();
  for (const CollisionTet& tet : tets) {
    if (std::ranges::any_of(tet.nodes, [&](int node) { return depth(node) > 0; })) add_shares(tet, x, normal, shares);
  }
  std::ranges::sort(shares, [](const Share& a, const Share& b) { return a.node != b.node ? a.node < b.node : a.order < b.order; });

  for (std::size_t k = 0; k < shares.size();) {
    Share sum{shares[k].node, 0, 0, 0};
    for (; k < shares.size() && shares[k].node == sum.node; ++k) {
      sum.area += shares[k].area;
      sum.volume += shares[k].volume;
    }
    const double below = depth(sum.node);
    if (below > 0) nodes.push_back({sum.node, below, sum.area > 0 ? sum.area : std::cbrt(sum.volume * sum.volume)});
  }
  return nodes;
}

}  // namespace crumple::sim::contact
