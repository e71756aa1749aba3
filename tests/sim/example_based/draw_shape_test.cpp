#include "server/sim/example_based/draw_shape.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

TEST(DrawShape, WithoutARenderMeshTheSurfaceIsDrawn) {
  const ExampleRest rest = make_rest(car());
  ExampleState state = make_state(rest, {});
  const int v = rest.surface_vertices[9];
  state.x[v] = Vec3(7, 8, 9);
  state.E.row(v) << 0.25, 0.6, 0, 0.15;
  std::vector<Vec3> x(draw_vertex_count(rest));
  std::vector<float> weights(3 * x.size());
  draw_positions(rest, state, x);
  draw_weights(rest, state, weights);
  EXPECT_EQ(x[9], Vec3(7, 8, 9));
  for (const auto& [e, weight] : {std::pair{0, 0.6f}, {1, 0.0f}, {2, 0.15f}}) {
    EXPECT_FLOAT_EQ(weights[e * x.size() + 9], weight);
    EXPECT_EQ(weights[e * x.size() + 8], 0.0f);
  }
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
  state.E.rowwise() = Eigen::RowVector4d(0.4, 0.1, 0.3, 0.2);
  const Tet& around = set->mesh.tets[rest.embedding.tet[1]];
  state.E.row(around[2]) << 0, 0, 1, 0;
  std::vector<Vec3> x(3);
  std::vector<float> weights(9);
  draw_positions(rest, state, x);
  draw_weights(rest, state, weights);
  for (int v = 0; v < 3; ++v) {
    EXPECT_LT((x[v] - R * set->render.vertices[v]).norm(), 1e-12);
  }
  // Between a tet's corners weights are as its positions are: linear.
  const double share = rest.embedding.weights[1][2];
  EXPECT_GT(share, 0.01);
  EXPECT_FLOAT_EQ(weights[1], static_cast<float>(0.1 * (1 - share)));
  EXPECT_FLOAT_EQ(weights[3 + 1], static_cast<float>(0.3 * (1 - share) + share));
  EXPECT_FLOAT_EQ(weights[6 + 1], static_cast<float>(0.2 * (1 - share)));
}

}  // namespace
}  // namespace crumple::sim::example_based
