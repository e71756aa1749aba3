#pragma once

#include "server/sim/contact/swept_surface.h"

#include <Eigen/Core>

#include <vector>

// Private to detect_swept.cpp: where features of two units' surfaces cross on their way through the step
// (feature_crossing.h), and which of them pass.
namespace crumple::sim::contact {

// A feature of one unit crosses the other's surface.
struct Encounter {
  int own, other;            // features
  double t;                  // below 0: where it would have been before the step, moving as it does
  bool enters;               // or leaves
  Vec3 normal;               // unit, out of the other's surface
  Eigen::Matrix<double, 4, 1, Eigen::DontAlign> weights;  // of own, then of the other's points; positive
  Vec3 relative;             // way of own less that of the other [m]
};

// A node that stays outside a triangle, by how much it stands over it at the start of the step.
struct Neighbour {
  Encounter encounter;
  double distance;  // [m]
};

// Of nodes with triangles, grouped by node, ascending. near: the nearest triangle of each node that crosses none in the step.
std::vector<Encounter> nodes_through_faces(const SweptSurface& own, const SweptSurface& other, double margin,
                                           std::vector<Neighbour>& near);

// Of edges with edges, at which both surfaces look the way of the normal, or both the other way; where they do not, edges
// graze. Grouped by own edge, ascending; both surfaces have found their edges.
std::vector<Encounter> edges_through_edges(const SweptSurface& own, const SweptSurface& other, double margin);

// As seen from the other side.
void swap_sides(std::vector<Encounter>& encounters);

// Of each feature what keeps it from passing: where it comes in, if it leaves again in the step, or has come in behind it
// and is not more than half through. Nothing if none passes. encounters: grouped by `own`.
std::vector<Encounter> passing(std::vector<Encounter>& encounters);

}  // namespace crumple::sim::contact
