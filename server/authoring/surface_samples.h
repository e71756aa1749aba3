#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <span>
#include <vector>

namespace crumple::authoring {

// Points of a surface not further apart than about `spacing` [m], for any positions of its vertices: the vertices,
// first and in order, then points on long edges, then points in large triangles. A fit to them is one to the surface
// as it is drawn, where a fit to the eight corners of a box would leave its sides to chance.
class SurfaceSamples {
 public:
  // surface must be valid; spacing > 0.
  SurfaceSamples(const sim::SurfaceMesh& surface, double spacing);

  int count() const { return vertices_ + static_cast<int>(samples_.size()); }

  // vertices: as many as the surface has [m].
  std::vector<Vec3> at(std::span<const Vec3> vertices) const;

 private:
  struct Sample {
    Triangle corners;
    Vec3 share;  // barycentric
  };
  int vertices_;
  std::vector<Sample> samples_;
};

}  // namespace crumple::authoring
