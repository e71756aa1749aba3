#pragma once

#include "server/sim/mesh/tet_mesh.h"

#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace crumple::sim {

// (1 - b1 - b2 - b3, b1, b2, b3) with p = x0 + b1 (x1 - x0) + b2 (x2 - x0) + b3 (x3 - x0). The tet must have volume.
Eigen::Vector4d barycentric(const Mat34& x, const Vec3& p);

// Squared distance of p to a tet of positive volume with corners x [m^2]; 0 inside and on the boundary.
double squared_distance(const Mat34& x, const Vec3& p);

// A binary tree of bounding boxes over the tets of a mesh, for point queries at rest. Keeps a reference to the mesh.
class TetTree {
 public:
  explicit TetTree(const TetMesh& mesh);

  // The tet nearest to p; of several at the same distance (several that enclose p) the one with the lowest id.
  // squared_distance: 0 if it encloses p [m^2]. The mesh must have a tet.
  struct Hit {
    int tet;
    double squared_distance;
  };
  Hit nearest(const Vec3& p) const;

  // The tets whose own boxes meet `box`, ascending.
  std::vector<int> near(const Eigen::AlignedBox3d& box) const;

 private:
  struct Branch {
    Eigen::AlignedBox3d box;
    int begin, end;  // range of order_
    int left;        // index of the first of two children; -1: a leaf
  };

  void build(int branch, std::span<const Vec3> centroids);
  void gather(int branch, const Eigen::AlignedBox3d& box, std::vector<int>& found) const;
  void visit(int branch, double box_distance, const Vec3& p, Hit& best) const;

  const TetMesh& mesh_;
  std::vector<int> order_;  // tet ids, leaf after leaf
  std::vector<Branch> branches_;
};

}  // namespace crumple::sim
