#include "server/authoring/triangle_bvh.h"

#include <algorithm>
#include <numeric>

namespace crumple::authoring {
namespace {

struct Builder {
  const sim::SurfaceMesh& surface;
  std::vector<Vec3> centroids;
  std::vector<int> order;
  std::vector<TriangleBvh::Node> nodes;

  int build(int first, int count) {
    const int id = static_cast<int>(nodes.size());
    nodes.push_back(box_of(first, count));
    if (count <= TriangleBvh::kLeafTriangles) return id;
    const int half = count / 2;
    const int axis = longest_axis(first, count);
    std::nth_element(order.begin() + first, order.begin() + first + half, order.begin() + first + count,
                     [&](int a, int b) {
                       const double ca = centroids[a][axis], cb = centroids[b][axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    build(first, half);
    nodes[id].right = build(first + half, count - half);
    return id;
  }

  TriangleBvh::Node box_of(int first, int count) const {
    Eigen::AlignedBox3d box;
    for (int k = first; k < first + count; ++k)
      for (const int v : surface.triangles[order[k]]) box.extend(surface.vertices[v]);
    return {.lower = box.min(), .upper = box.max(), .first = first, .count = count};
  }

  int longest_axis(int first, int count) const {
    Eigen::AlignedBox3d box;
    for (int k = first; k < first + count; ++k) box.extend(centroids[order[k]]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    return axis;
  }
};

}  // namespace

TriangleBvh::TriangleBvh(const sim::SurfaceMesh& surface) {
  const int n = static_cast<int>(surface.triangles.size());
  if (n == 0) return;
  Builder builder{surface, {}, std::vector<int>(n), {}};
  std::iota(builder.order.begin(), builder.order.end(), 0);
  const auto corner = [&](int t, int k) -> const Vec3& { return surface.vertices[surface.triangles[t][k]]; };
  for (int t = 0; t < n; ++t) builder.centroids.push_back((corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0);
  builder.build(0, n);
  nodes = std::move(builder.nodes);
  triangle = std::move(builder.order);
  for (const int t : triangle) corners.push_back({corner(t, 0), corner(t, 1), corner(t, 2)});
}

}  // namespace crumple::authoring
