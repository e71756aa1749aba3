#pragma once

#include "server/sim/example_based/deform.h"

#include <span>
#include <vector>

// Where on the mesh an impulse of the rigid solver acts. (Jones et al. 2016 speak of "an impulse j_i at vertex i"; a
// solver gives points on a collision shape that only nears the skin.)
namespace crumple::sim::example_based {

struct PointImpulse {
  Vec3 point = Vec3::Zero();    // [m] in the asset's axes
  Vec3 impulse = Vec3::Zero();  // [N s] in the asset's axes
};

// Which vertices an impulse goes to.
enum class Site {
  // The nearest surface vertex; impulses that land on the same vertex are added. The default: beta then sees one blow
  // as one impulse, however many contact points the solver made of it, and each site costs one Jacobian and one search
  // that is kept. The place is off by half an edge at most, which a kernel of several edges does not show.
  nearest_vertex,
  // The three vertices of the nearest surface triangle, the plastic displacement shared out by barycentric coordinates:
  // the dent moves continuously with the point. For coarse meshes; beta acts on each point by itself.
  nearest_triangle,
};

// The surface vertex of the deformed shape that is nearest to `point` [m, asset's axes]; among equals the lowest id.
// Looks at every surface vertex: for a few points.
int nearest_surface_vertex(const ExampleRest& rest, const ExampleState& state, const Vec3& point);

// All impulses of a step at once, through the surface tree refitted to the deformed shape. `out` is what `deform`
// takes: for nearest_vertex ascending by vertex, for nearest_triangle in the order of `impulses`. An impulse or point
// that is not finite is handed on at the lowest surface vertex with an infinite impulse, for `deform` to reject and
// report.
void locate_impulses(const ExampleRest& rest, const ExampleState& state, std::span<const PointImpulse> impulses,
                     Site site, SurfaceTree::Boxes& boxes, std::vector<VertexImpulse>& out);

}  // namespace crumple::sim::example_based
