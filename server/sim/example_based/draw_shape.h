#pragma once

#include "server/sim/example_based/example_state.h"

#include <span>

// What a viewer draws of an example-based body: its `render` mesh carried by the tets, or the tets' own surface
// (rest.surface_vertices, in that order). Triangles: rest.draw_triangles.
namespace crumple::sim::example_based {

// Fills rest.embedding and rest.draw_triangles; part of make_rest.
void prepare_drawing(ExampleRest& rest);

int draw_vertex_count(const ExampleRest& rest);

// Positions [m, asset's axes], one a draw vertex.
void draw_positions(const ExampleRest& rest, const ExampleState& state, std::span<Vec3> out);

// E_ie of each example other than rest, one a draw vertex, example after example, in [0, 1]. out: E - 1 times as many as
// draw vertices.
void draw_weights(const ExampleRest& rest, const ExampleState& state, std::span<float> out);

}  // namespace crumple::sim::example_based
