#include "server/sim/example_based/impulse_site.h"

#include <algorithm>
#include <limits>

namespace crumple::sim::example_based {
namespace {

constexpr double kMinShare = 1e-9;
// Up to so many points it is quicker to look at every vertex than to refit the tree's boxes. Same vertex either way.
constexpr int kFewPoints = 8;

void add_at_same_vertex(std::vector<VertexImpulse>& at) {
  std::stable_sort(at.begin(), at.end(), [](const auto& a, const auto& b) { return a.vertex < b.vertex; });
  std::size_t kept = 0;
  for (std::size_t k = 0; k < at.size(); ++k) {
    if (kept > 0 && at[kept - 1].vertex == at[k].vertex)
      at[kept - 1].impulse += at[k].impulse;
    else
      at[kept++] = at[k];
  }
  at.resize(kept);
}

}  // namespace

int nearest_surface_vertex(const ExampleRest& rest, const ExampleState& state, const Vec3& point) {
  int found = rest.surface_vertices.front();
  double best = std::numeric_limits<double>::infinity();
  for (int i : rest.surface_vertices) {
    const double distance2 = (point - state.x[i]).squaredNorm();
    if (distance2 < best) {
      best = distance2;
      found = i;
    }
  }
  return found;
}

void locate_impulses(const ExampleRest& rest, const ExampleState& state, std::span<const PointImpulse> impulses,
                     Site site, SurfaceTree::Boxes& boxes, std::vector<VertexImpulse>& out) {
  out.clear();
  if (impulses.empty()) return;
  const bool few = site == Site::nearest_vertex && impulses.size() <= kFewPoints;
  if (!few) rest.surface_tree.refit(state.x, boxes);
  for (const auto& [point, impulse] : impulses) {
    if (!point.allFinite() || !impulse.allFinite()) {
      out.push_back({rest.surface_vertices.front(), Vec3::Constant(std::numeric_limits<double>::infinity())});
    } else if (site == Site::nearest_vertex) {
      out.push_back({few ? nearest_surface_vertex(rest, state, point) : rest.surface_tree.nearest_vertex(point, state.x, boxes), impulse});
    } else {
      const SurfacePoint nearest = rest.surface_tree.nearest(point, state.x, boxes);
      for (int k = 0; k < 3; ++k)
        if (nearest.weights[k] > kMinShare)
          out.push_back({rest.surface[nearest.triangle][k], impulse, nearest.weights[k]});
    }
  }
  if (site == Site::nearest_vertex) add_at_same_vertex(out);
}

}  // namespace crumple::sim::example_based
