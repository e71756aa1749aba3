#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <map>
#include <utility>

namespace crumple::test {

// How a surface hangs together, by its edges.
struct EdgeCount {
  int edges = 0;
  bool closed = true;    // every edge has exactly two triangles ...
  bool oriented = true;  // ... that run along it in opposite directions
};

inline EdgeCount count_edges(const sim::SurfaceMesh& surface) {
  std::map<std::pair<int, int>, std::pair<int, int>> uses;  // (low, high) -> runs from low to high, from high to low
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      auto& use = uses[std::minmax(a, b)];
      ++(a < b ? use.first : use.second);
    }
  EdgeCount out;
  for (const auto& [edge, use] : uses) {
    ++out.edges;
    out.closed = out.closed && use.first + use.second == 2;
    out.oriented = out.oriented && use.first == use.second;
  }
  return out;
}

inline int euler_characteristic(const sim::SurfaceMesh& surface) {
  return static_cast<int>(surface.vertices.size()) - count_edges(surface).edges +
         static_cast<int>(surface.triangles.size());
}

// Without the triangles whose centroid is above `height` in z.
inline sim::SurfaceMesh opened_above(sim::SurfaceMesh surface, double height) {
  std::erase_if(surface.triangles, [&](const Triangle& t) {
    return (surface.vertices[t[0]] + surface.vertices[t[1]] + surface.vertices[t[2]]).z() / 3 > height;
  });
  return surface;
}

// A flat square of side 2 in the plane z = 0, facing +z.
inline sim::SurfaceMesh square_sheet() {
  return {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
}

}  // namespace crumple::test
