#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::sim::example_based {

// The nearest point of a surface: a place on one triangle.
struct SurfacePoint {
  int triangle = -1;
  Vec3 weights = Vec3::Zero();  // barycentric, >= 0, sum 1
  double distance2 = 0;         // squared [m^2]
};

// Barycentric coordinates of the point of triangle abc (degenerate or not) that is nearest to p.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

// A tree of boxes over the triangles of a surface that changes its shape but not its topology. The tree is constant;
// its boxes belong to one shape and are made by `refit` in time linear in the triangles.
class SurfaceTree {
 public:
  using Boxes = std::vector<Eigen::AlignedBox3d>;

  SurfaceTree() = default;
  // x: vertex positions the tree is arranged for [m].
  SurfaceTree(std::span<const Vec3> x, std::span<const Triangle> triangles);

  void refit(std::span<const Vec3> x, Boxes& boxes) const;

  // Exact for the shape x that `boxes` were refitted to; among equals the lowest id.
  SurfacePoint nearest(const Vec3& p, std::span<const Vec3> x, const Boxes& boxes) const;
  int nearest_vertex(const Vec3& p, std::span<const Vec3> x, const Boxes& boxes) const;

 private:
  struct Node {
    int left = -1, right = -1;  // both above the node's own index; -1 at a leaf
    int first = 0, count = 0;   // of order_, at a leaf
  };
  static constexpr int kLeaf = 4;
  int build(std::span<const Vec3> centroids, int first, int count);
  template <class Visit>
  void descend(int node, const Vec3& p, const Boxes& boxes, const double& best, const Visit& visit) const;

  std::vector<Triangle> triangles_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace crumple::sim::example_based
