#include "server/sim/example_based/draw_shape.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::example_based {

void prepare_drawing(ExampleRest& rest) {
  const SurfaceMesh& render = rest.set->render;
  if (!render.vertices.empty()) {
    rest.embedding = embed(render.vertices, rest.set->mesh);
    rest.draw_triangles = render.triangles;
    return;
  }
  rest.draw_triangles = rest.surface;
  for (Triangle& triangle : rest.draw_triangles)
    for (int& i : triangle)
      i = static_cast<int>(std::ranges::lower_bound(rest.surface_vertices, i) - rest.surface_vertices.begin());
}

int draw_vertex_count(const ExampleRest& rest) {
  return static_cast<int>(rest.embedding.tet.empty() ? rest.surface_vertices.size() : rest.embedding.tet.size());
}

void draw_positions(const ExampleRest& rest, const ExampleState& state, std::span<Vec3> out) {
  assert(static_cast<int>(out.size()) == draw_vertex_count(rest));
  if (!rest.embedding.tet.empty()) {
    embedded_positions(rest.embedding, rest.set->mesh.tets, state.x, out);
    return;
  }
  for (std::size_t v = 0; v < out.size(); ++v) out[v] = state.x[rest.surface_vertices[v]];
}

void draw_weights(const ExampleRest& rest, const ExampleState& state, std::span<float> out) {
  const auto vertices = static_cast<std::size_t>(draw_vertex_count(rest));
  assert(out.size() == static_cast<std::size_t>(rest.set->example_count() - 1) * vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    for (int e = 1; e < rest.set->example_count(); ++e) {
      double weight = 0;
      if (rest.embedding.tet.empty()) {
        weight = state.E(rest.surface_vertices[v], e);
      } else {
        const Tet& tet = rest.set->mesh.tets[rest.embedding.tet[v]];
        for (int k = 0; k < 4; ++k) weight += rest.embedding.weights[v][k] * state.E(tet[k], e);
      }
      out[static_cast<std::size_t>(e - 1) * vertices + v] = static_cast<float>(std::clamp(weight, 0.0, 1.0));
    }
  }
}

}  // namespace crumple::sim::example_based
