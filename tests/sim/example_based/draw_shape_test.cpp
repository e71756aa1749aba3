#include "server/sim/example_based/draw_shape.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(DrawShape, WithoutARenderMeshTheSurfaceIsDrawn) {
  const ExampleRest rest = make_rest(car());
  ExampleState state = make_state(rest, {});
  const int v = rest.surface_vertices[9];
  state.x[v] = Vec3(7, 8, 9);
  state.E.row(v) << 0.25, 0.75, 0, 0;
  std::vector<Vec3> x(draw_vertex_count(rest));
  std::vector<float> values(x.size());
  draw_positions(rest, state, x);
  draw_values(rest, state, values);
  EXPECT_EQ(x[9], Vec3(7, 8, 9));
  EXPECT_FLOAT_EQ(values[9], 0.75f);
  EXPECT_EQ(values[8], 0.0f);
  // Closed, and as large as the box: the divergence theorem over the triangles gives its volume.
  draw_positions(rest, make_state(rest, {}), x);
  double volume = 0;
  for (const auto& [a, b, c] : rest.draw_triangles) volume += x[a].cross(x[b]).dot(x[c]) / 6;
  EXPECT_NEAR(volume, 0.6 * 0.6 * 1.6, 1e-12);
}

TEST(DrawShape, ARenderMeshFollowsItsTets) {
  auto set = car();
  set->render.vertices = {Vec3(0.1, 0.2, 0.3), Vec3(-0.3, 0.25, -0.71), Vec3(0, 0, 0.05)};
  set->render.triangles = {{0, 1, 2}};
  const ExampleRest rest = make_rest(set);
  ASSERT_EQ(draw_vertex_count(rest), 3);
  EXPECT_EQ(rest.draw_triangles, set->render.triangles);
  ExampleState state = make_state(rest, {});
  const Quat R = turn(77, Vec3(1, 1, 0)).q;
  for (Vec3& p : state.x) p = R * p;
  state.E.col(0).setConstant(0.4);
  std::vector<Vec3> x(3);
  std::vector<float> values(3);
  draw_positions(rest, state, x);
  draw_values(rest, state, values);
  for (int v = 0; v < 3; ++v) {
    EXPECT_LT((x[v] - R * set->render.vertices[v]).norm(), 1e-12);
    EXPECT_FLOAT_EQ(values[v], 0.6f);
  }
}

}  // namespace
}  // namespace crumple::sim::example_based
