#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <span>

// Closed surfaces, outward, centred on the origin. Caller's bugs (a size that is not positive, too few segments) are
// asserted.
namespace crumple::authoring {

// 12 triangles.
sim::SurfaceMesh box_surface(const Vec3& half_extents);

// An icosahedron whose triangles are cut in four `levels` times, on a sphere: 20 4^levels triangles.
sim::SurfaceMesh icosphere(double radius, int levels);

// Axis y.
sim::SurfaceMesh cylinder_surface(double radius, double half_length, int segments);

// A profile turned about the y axis. profile: (distance from the axis, y) from the lower to the upper pole [m]; the
// first and the last point lie on the axis (distance 0), all others off it.
// 2 segments (profile.size() - 2) triangles.
sim::SurfaceMesh lathe(std::span<const Eigen::Vector2d> profile, int segments);

// Adds a part; its vertices are placed by `pose` first.
void append(sim::SurfaceMesh& surface, const sim::SurfaceMesh& part, const Pose& pose = {});

// Volume by the divergence theorem [m^3]: positive for a closed outward surface.
double enclosed_volume(const sim::SurfaceMesh& surface);

}  // namespace crumple::authoring
