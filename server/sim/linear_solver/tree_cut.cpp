#include "server/sim/linear_solver/tree_cut.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace crumple::sim::linear_solver {
namespace {

constexpr std::size_t kLeastWork = 40000;  // that is worth two branches: values of a factor, some 10 us to substitute
constexpr double kWorthwhile = 0.8;        // longest share that is
constexpr int kMostCuts = 200;             // in search of the best

}  // namespace

// Starts with no trunk. As long as it pays, the heaviest tree loses its root to the trunk; what is left goes to the lighter branch,
// heaviest first.
TreeCut cut_tree(std::span<const int> parent, std::span<const std::size_t> work) {
  const int count = static_cast<int>(parent.size());
  std::vector<std::size_t> whole(work.begin(), work.end());  // with all below
  std::vector<std::vector<int>> children(count);
  std::vector<int> trees;
  for (int p = 0; p < count; ++p) {
    if (parent[p] < 0) {
      trees.push_back(p);
      continue;
    }
    children[parent[p]].push_back(p);
    whole[parent[p]] += whole[p];
  }
  const auto heavier = [&](int a, int b) { return whole[a] != whole[b] ? whole[a] > whole[b] : a < b; };
  const auto share_out = [&](const std::vector<int>& heaviest_first, const auto& give) {
    std::array<std::size_t, 2> load{};
    for (const int tree : heaviest_first) {
      const int to = load[1] < load[0];
      load[to] += whole[tree];
      give(tree, to);
    }
    return std::max(load[0], load[1]);
  };

  const std::size_t all = std::accumulate(work.begin(), work.end(), std::size_t{0});
  std::size_t trunk = 0, best = all;
  std::vector<int> best_trees;
  for (int cut = 0; cut < kMostCuts && all >= kLeastWork && !trees.empty() && trunk < best; ++cut) {
    std::ranges::sort(trees, heavier);
    if (const std::size_t longest = trunk + share_out(trees, [](int, int) {}); longest < best) best = longest, best_trees = trees;
    const int root = trees.front();
    trees.erase(trees.begin());
    trunk += work[root];
    trees.insert(trees.end(), children[root].begin(), children[root].end());
  }
  TreeCut cut{.branch = std::vector<int>(count, -1)};
  const double share = best < all ? static_cast<double>(best) / static_cast<double>(all) : 1;
  if (share > kWorthwhile) return cut;
  cut.longest_share = share;
  share_out(best_trees, [&](int tree, int to) { cut.branch[tree] = to; });
  for (int p = count - 1; p >= 0; --p)
    if (cut.branch[p] < 0 && parent[p] >= 0) cut.branch[p] = cut.branch[parent[p]];
  return cut;
}

}  // namespace crumple::sim::linear_solver
