#include "server/lab/split_times.h"

#include "common/text.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/lab/median.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"
#include "server/sim/mesh/node_stars.h"

#include <algorithm>
#include <ctime>
#include <random>

namespace crumple::lab {
namespace {

using Matrix = sim::linear_solver::BlockSparseMatrix<double>;
using sim::linear_solver::MultigridHierarchy;

double processor_us() { return 1e6 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Only its pattern matters.
Matrix matrix_of(const sim::TetMesh& mesh) {
  std::vector<std::array<int, 2>> edges;
  for (const Tet& tet : mesh.tets)
    for (const int i : tet)
      for (const int j : tet)
        if (i < j) edges.push_back({i, j});
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return Matrix::from_edges(mesh.node_count(), edges);
}

// The tets of a random node on one side of a random plane through it get a node of their own.
void split_any(std::mt19937_64& random, sim::TetMesh& mesh, sim::NodeStars& stars) {
  std::normal_distribution<double> normal;
  while (true) {
    const int node = static_cast<int>(random() % mesh.X.size());
    const Vec3 n(normal(random), normal(random), normal(random));
    const auto beyond = [&](int t) {
      Vec3 centre = Vec3::Zero();
      for (const int i : mesh.tets[t]) centre += 0.25 * mesh.X[i];
      return n.dot(centre - mesh.X[node]) > 0;
    };
    const auto count = std::ranges::count_if(stars[node], beyond);
    if (count == 0 || count == static_cast<std::ptrdiff_t>(stars[node].size())) continue;
    const int added = stars.split(node, beyond);
    for (const int t : stars[added]) std::ranges::replace(mesh.tets[t], node, added);
    mesh.X.push_back(mesh.X[node]);
    return;
  }
}

bool same_levels(const MultigridHierarchy& a, const MultigridHierarchy& b) {
  return std::ranges::equal(a.levels(), b.levels(), [](const auto& p, const auto& q) {
    return p.transfer == q.transfer && p.product == q.product && std::ranges::equal(p.A.columns(), q.A.columns());
  });
}

}  // namespace

Result<Json> time_splits(const SplitTimesOptions& options) {
  for (const int c : options.cells)
    if (c < 2 || c > 100) return invalid("cells", text("is ", c, ", must be in [2, 100]"));
  if (options.splits < 1 || options.splits > 10'000) return invalid("splits", text("is ", options.splits, ", must be in [1, 10000]"));
  const Vec3 size(options.cells[0], options.cells[1], options.cells[2]);
  auto made = authoring::centred_box_mesh(size, options.cells, authoring::Lattice::kuhn);
  if (!made) return std::unexpected(made.error());
  sim::TetMesh& mesh = *made;
  const double mean_tet_volume = 1.0 / 6;
  const sim::ThreadPool pool(1);
  sim::NodeStars stars(mesh.tets, mesh.node_count());
  std::mt19937_64 random(1);
  MultigridHierarchy followed;
  std::vector<char> held(mesh.X.size(), 0);
  followed.update(matrix_of(mesh), mesh.X, held, mean_tet_volume, pool);
  Json result{{"nodes", mesh.node_count()}, {"tets", mesh.tet_count()}, {"levels", followed.levels().size()}, {"splits", options.splits}};
  std::vector<double> follow_us, anew_us, values_us;
  const auto timed = [&](std::vector<double>& times, MultigridHierarchy& hierarchy, const Matrix& A) {
    const double start = processor_us();
    hierarchy.update(A, mesh.X, held, mean_tet_volume, pool);
    times.push_back(processor_us() - start);
  };
  for (int k = 0; k < options.splits; ++k) {
    split_any(random, mesh, stars);
    held.assign(mesh.X.size(), 0);
    const Matrix A = matrix_of(mesh);
    timed(follow_us, followed, A);
    MultigridHierarchy anew;
    timed(anew_us, anew, A);
    timed(values_us, anew, A);
    if (!same_levels(followed, anew)) return std::unexpected(Error{ErrorCode::internal, "splits", text("followed and anew differ after ", k + 1)});
  }
  const double values = median(values_us);
  result["followed_us"] = median(follow_us) - values;
  result["anew_us"] = median(anew_us) - values;
  result["values_us"] = values;
  return result;
}

}  // namespace crumple::lab
