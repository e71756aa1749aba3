#include "server/authoring/handles.h"

#include "tests/authoring/handles_for_tests.h"

namespace crumple::authoring {
namespace {

using sim::TetMesh;

TEST(Handles, ABoneHoldsEveryVertexAlongIt) {
  const TetMesh mesh = *box_mesh({.size = {4, 2, 2}, .cells = {8, 4, 4}, .minimum = Vec3(-2, -1, -1)});
  Handles handles{{Handle{{-2, 0, 0}, {0, 0, 0}}, Handle{{0, 0, 0}, {2, 0, 0}}}};
  const auto prescribed = prescribed_weights(mesh, handles);
  ASSERT_TRUE(prescribed) << prescribed.error().text();
  EXPECT_EQ(prescribed->vertices.size(), 9u);
  EXPECT_EQ(prescribed->shared, 1);  // the joint
  for (size_t k = 0; k < prescribed->vertices.size(); ++k) {
    const Vec3& X = mesh.X[prescribed->vertices[k]];
    EXPECT_NEAR(X.tail<2>().norm(), 0, 1e-12);
    EXPECT_EQ(prescribed->weights(static_cast<int>(k), 0), X.x() < 0 ? 1 : X.x() == 0 ? 0.5 : 0);
  }
  // A point in the joint takes it.
  handles.handles.push_back(Handle::point(Vec3::Zero()));
  const auto with_joint = prescribed_weights(mesh, handles);
  ASSERT_TRUE(with_joint);
  EXPECT_EQ(with_joint->shared, 0);
  EXPECT_EQ(with_joint->weights.col(2).maxCoeff(), 1);
  EXPECT_EQ(with_joint->weights.col(2).sum(), 1);
}

TEST(Handles, WeightsAreLinearAlongACage) {
  const TetMesh mesh = *box_mesh({.size = {1, 1, 1}, .cells = {4, 4, 4}, .minimum = Vec3::Zero()});
  Handles handles = points({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 1}});
  handles.cage_edges = {{0, 3}};
  handles.cage_faces = {{0, 1, 2}};
  const auto out = solve(mesh, handles);
  EXPECT_LT(outside_simplex(out.W), 1e-9);
  int along_edge = 0, on_face = 0;
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Vec3& X = mesh.X[i];
    if (X.x() == 0 && X.y() == 0) {
      EXPECT_NEAR(out.W(i, 3), X.z(), 1e-12);
      EXPECT_NEAR(out.W(i, 0), 1 - X.z(), 1e-12);
      ++along_edge;
    } else if (X.z() == 0 && X.y() <= X.x()) {  // barycentric: 1 - x, x - y, y
      EXPECT_NEAR(out.W(i, 0), 1 - X.x(), 1e-12);
      EXPECT_NEAR(out.W(i, 1), X.x() - X.y(), 1e-12);
      EXPECT_NEAR(out.W(i, 2), X.y(), 1e-12);
      ++on_face;
    }
  }
  EXPECT_EQ(along_edge, 5);
  EXPECT_EQ(on_face, 14);
}

TEST(Handles, TwoPointsInOnePlaceShareIt) {
  const TetMesh mesh = bar(8, 0.1);
  const auto out = solve(mesh, points({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ(out.report.shared_vertices, 1);
  EXPECT_LT(outside_simplex(out.W), 1e-9);
  EXPECT_NEAR((out.W.col(0) - out.W.col(1)).cwiseAbs().maxCoeff(), 0, 1e-12);
}

}  // namespace
}  // namespace crumple::authoring
