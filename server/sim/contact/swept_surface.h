#pragma once

#include "server/sim/contact/detector.h"

#include <array>
#include <span>
#include <vector>

// Private to detect_swept.cpp: what of a unit's surface may pass another unit.
namespace crumple::sim::contact {

struct SurfaceNode {
  int node, tet;  // tet: in CollisionMesh::tets
};
struct SurfaceFace {
  Triangle nodes;
  int tet;
};
struct SurfaceEdge {
  int a, b, tet;
  std::array<int, 2> faces;  // in SweptSurface::faces; the second -1 where it is not near
};

// The part of a unit's surface whose way comes near another unit.
struct SweptSurface {
  const Detector& detector;
  const Unit& unit;
  std::vector<SurfaceNode> nodes;  // ascending
  std::vector<SurfaceFace> faces;
  std::vector<SurfaceEdge> edges;  // of find_edges

  // Needs unit.way_boxes. zone: what is near.
  SweptSurface(const Detector& detector, const Unit& unit, const Box3& zone);
  void find_edges();

  Vec3 start(int node) const { return detector.in.bodies[unit.body].x[node]; }
  Vec3 way(int node) const { return detector.placed[unit.body].x[node] - start(node); }
  Box3 box(std::span<const int> of, double margin) const;  // of the nodes' ways
  // Sum of the unit normals of an edge's faces at time t.
  Vec3 outward(const SurfaceEdge& edge, double t) const;
};

}  // namespace crumple::sim::contact
