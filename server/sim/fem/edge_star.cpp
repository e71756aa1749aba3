#include "server/sim/fem/edge_star.h"

#include "server/sim/fem/rest_body.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <map>

namespace crumple::sim::fem {

std::vector<EdgeStar> edge_stars_by_length(const std::vector<Tet>& tets, const RestBody& rest, const std::function<bool(int t)>& is_eligible) {
  std::map<std::array<int, 2>, EdgeStar> by_edge;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    if (!is_eligible(t)) continue;
    const Mat34 X = rest_nodes(rest, t);
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) {
        const auto [low, high] = std::minmax(tets[t][a], tets[t][b]);
        EdgeStar& star = by_edge[{low, high}];
        star.edge = {low, high};
        star.shortness = -std::llround(1e6 * (X.col(a) - X.col(b)).norm() / rest.mean_edge);
        star.tets.push_back(t);
      }
  }
  std::vector<EdgeStar> stars;
  for (auto& [edge, star] : by_edge) stars.push_back(std::move(star));
  std::ranges::stable_sort(stars, {}, &EdgeStar::shortness);
  return stars;
}

std::array<int, 2> around(const Tet& tet, const std::array<int, 2>& edge) {
  std::array<int, 4> at{-1, -1, -1, -1};  // local: ends, then the others as they come
  int others = 2;
  for (int a = 0; a < 4; ++a) {
    if (tet[a] == edge[0]) at[0] = a;
    else if (tet[a] == edge[1]) at[1] = a;
    else at[others++] = a;
  }
  int inversions = 0;
  for (int p = 0; p < 4; ++p)
    for (int q = p + 1; q < 4; ++q) inversions += at[p] > at[q];
  if (inversions % 2 == 1) std::swap(at[2], at[3]);
  return {tet[at[2]], tet[at[3]]};
}

Mat34 rest_nodes(const RestBody& rest, int t) {
  Mat34 X = Mat34::Zero();
  X.rightCols<3>() = rest.beta[t].inverse();
  return X;
}

}  // namespace crumple::sim::fem
