#include "server/authoring/pose_from_shape.h"

#include "server/authoring/handle_placement.h"
#include "server/authoring/pose_field.h"
#include "server/authoring/rig_from_shapes.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/authoring/shapes/surfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

namespace crumple::authoring {
namespace {

using sim::SurfaceMesh;
using sim::TetMesh;
using ::testing::HasSubstr;

// A bar of 2 x 0.4 x 0.4 and its own surface, drawn.
struct Bar {
  TetMesh mesh = *centred_box_mesh({2, 0.4, 0.4}, {15, 3, 3}, Lattice::bcc);
  SurfaceMesh surface;
  Handles handles;
  Eigen::MatrixXd W;

  explicit Bar(int handle_count) {
    std::vector<int> id_of(mesh.X.size(), -1);
    for (const auto& face : sim::surface_faces(mesh.tets)) {
      Triangle t;
      for (int k = 0; k < 3; ++k) {
        int& id = id_of[face.nodes[k]];
        if (id < 0) {
          id = static_cast<int>(surface.vertices.size());
          surface.vertices.push_back(mesh.X[face.nodes[k]]);
        }
        t[k] = id;
      }
      surface.triangles.push_back(t);
    }
    for (const int id : place_handles(mesh, surface_nodes(mesh.tets), handle_count))
      handles.handles.push_back(Handle::point(mesh.X[id]));
    W = bounded_biharmonic_weights(mesh, handles)->W;
  }

  DeformedShape moved(const PoseField& field) const {
    DeformedShape out{"moved", surface.vertices};
    for (Vec3& x : out.vertices) x += field(x);
    return out;
  }
};

Vec3 posed(const Bar& bar, const sim::example_based::Example& example, int i) {
  Vec3 x = Vec3::Zero();
  for (int b = 0; b < bar.W.cols(); ++b) x += bar.W(i, b) * (example.bones[b].q * bar.mesh.X[i] + example.bones[b].t);
  return x;
}

PoseField bent() { return kink({.axis = Vec3::UnitX(), .hinge = Vec3::UnitZ(), .angle = 1.2, .width = 0.3}); }

TEST(EmbeddedSkinning, IsTheSkinnedMeshsOwnEmbedding) {
  const Bar bar(6);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  std::vector<HandleMotion> motions = skin.rest();
  for (int v = 0; v < skin.point_count(); ++v)
    EXPECT_NEAR((skin.position(v, motions) - bar.surface.vertices[v]).norm(), 0, 1e-13);
  sim::example_based::Example example;
  for (int b = 0; b < skin.handle_count(); ++b) {
    motions[b] = {Eigen::AngleAxisd(0.3 * b, Vec3(1, b, 2).normalized()).toRotationMatrix(), Vec3(b, 2, 0.1 * b)};
    example.bones.push_back({Quat(motions[b].R), motions[b].s - motions[b].R * skin.pivot(b)});
  }
  for (int v = 0; v < skin.point_count(); ++v) {  // every drawn vertex is a node here
    int node = 0;
    while (bar.mesh.X[node] != bar.surface.vertices[v]) ++node;
    EXPECT_NEAR((skin.position(v, motions) - posed(bar, example, node)).norm(), 0, 1e-12);
  }
}

TEST(PoseFromShape, FindsKnownTransformsAgain) {
  const Bar bar(8);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  std::vector<HandleMotion> motions = skin.rest();
  for (int b = 0; b < 8; ++b) {
    motions[b].R =
        Eigen::AngleAxisd(0.9 * std::sin(b + 1.0), Vec3(std::sin(3.0 * b), 1, std::cos(5.0 * b)).normalized())
            .toRotationMatrix();
    motions[b].s += 0.3 * Vec3(std::cos(b), std::sin(2.0 * b), std::cos(3.0 * b));
  }
  DeformedShape shape{"known", {}};
  for (int v = 0; v < skin.point_count(); ++v) shape.vertices.push_back(skin.position(v, motions));
  const auto found = pose_from_shape(skin, bar.surface.vertices, shape);
  ASSERT_TRUE(found) << found.error().text();
  EXPECT_TRUE(found->residual.converged);
  EXPECT_LT(found->residual.relative(), 1e-6);
  EXPECT_LT(found->residual.max, 1e-6 * found->residual.displacement_max);
  for (int b = 0; b < 8; ++b) EXPECT_LT((found->example.bones[b].q.toRotationMatrix() - motions[b].R).norm(), 1e-4);
}

TEST(PoseFromShape, ARigidMotionOfTheShapeIsThatOfEveryHandle) {
  const Bar bar(5);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  const Mat3 R = Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 t(5, -1, 2);
  DeformedShape shape{"turned", bar.surface.vertices};
  for (Vec3& x : shape.vertices) x = R * x + t;
  const auto found = pose_from_shape(skin, bar.surface.vertices, shape);
  ASSERT_TRUE(found);
  EXPECT_LT(found->residual.relative(), 1e-9);
  for (const auto& bone : found->example.bones) {
    EXPECT_LT((bone.q.toRotationMatrix() - R).norm(), 1e-6);
    EXPECT_LT((bone.t - t).norm(), 1e-6);
  }
}

TEST(PoseFromShape, ShapeAtRestLeavesNothingOver) {
  const Bar bar(5);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  const auto found = pose_from_shape(skin, bar.surface.vertices, {"rest", bar.surface.vertices});
  ASSERT_TRUE(found);
  EXPECT_LT(found->residual.rms, 1e-12);
}

TEST(PoseFromShape, ReportsWhatIsLeftOver) {
  const Bar bar(4);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  const DeformedShape shape = bar.moved(bent());
  const auto found = pose_from_shape(skin, bar.surface.vertices, shape);
  ASSERT_TRUE(found);
  double sum = 0, worst = 0;
  for (size_t v = 0; v < shape.vertices.size(); ++v) {
    int node = 0;
    while (bar.mesh.X[node] != bar.surface.vertices[v]) ++node;
    const double off = (posed(bar, found->example, node) - shape.vertices[v]).norm();
    sum += off * off;
    worst = std::max(worst, off);
  }
  EXPECT_NEAR(found->residual.rms, std::sqrt(sum / static_cast<double>(shape.vertices.size())), 1e-12);
  EXPECT_NEAR(found->residual.max, worst, 1e-12);
  EXPECT_GT(found->residual.relative(), 1e-3);
  EXPECT_LT(found->residual.relative(), 0.5);
}

TEST(PoseFromShape, AnotherNumberOfVerticesIsAnError) {
  const Bar bar(4);
  const EmbeddedSkinning skin(bar.mesh, bar.W, bar.surface.vertices);
  DeformedShape shape{"short", bar.surface.vertices};
  shape.vertices.pop_back();
  EXPECT_THAT(pose_from_shape(skin, bar.surface.vertices, shape).error().text(), HasSubstr("shape.vertices holds "));
  shape.vertices.push_back(Vec3::Constant(std::nan("")));
  EXPECT_THAT(pose_from_shape(skin, bar.surface.vertices, shape).error().text(), HasSubstr("is not finite"));
}

// Prints seconds: 32 handles, as the paper's car has.
TEST(PoseFromShapeSlow, ThirtyTwoHandles) {
  Bar bar(2);
  bar.mesh = *centred_box_mesh({2, 1, 0.6}, {22, 11, 7}, Lattice::bcc);
  Handles handles;
  for (const int id : place_handles(bar.mesh, surface_nodes(bar.mesh.tets), 32))
    handles.handles.push_back(Handle::point(bar.mesh.X[id]));
  const auto weights = bounded_biharmonic_weights(bar.mesh, handles);
  ASSERT_TRUE(weights);
  const EmbeddedSkinning skin(bar.mesh, weights->W);
  DeformedShape shape{"bent", bar.mesh.X};
  for (Vec3& x : shape.vertices) x += bent()(x);
  const auto start = std::chrono::steady_clock::now();
  const auto found = pose_from_shape(skin, bar.mesh.X, shape);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_TRUE(found);
  EXPECT_LT(found->residual.relative(), 0.1);
  std::printf("%d vertices: %.2f s, %d sweeps, %d steps, residual %.4f of the displacement\n", bar.mesh.node_count(),
              seconds, found->residual.sweeps, found->residual.steps, found->residual.relative());
}

TEST(PoseFromShape, ATurnPenaltyKeepsHandlesUpright) {
  const Bar bar(8);
  const EmbeddedSkinning skinning(bar.mesh, bar.W, bar.surface.vertices);
  const auto fit = [&](double penalty) {
    return *pose_from_shape(skinning, bar.surface.vertices, bar.moved(bent()), "shape", penalty);
  };
  const auto largest_turn = [](const FittedPose& pose) {
    double turn = 0;
    for (const auto& bone : pose.example.bones) turn = std::max(turn, bone.q.angularDistance(Quat::Identity()));
    return turn;
  };
  const FittedPose freely = fit(0), little = fit(0.01), upright = fit(100);
  EXPECT_GT(largest_turn(freely), 0.3);
  EXPECT_LT(largest_turn(upright), 0.05);
  EXPECT_LT(freely.residual.rms, little.residual.rms);
  EXPECT_LT(little.residual.rms, upright.residual.rms);
}

// ---- a rig for given shapes
TEST(RigFromShapes, AddsHandlesUntilABentBarIsMet) {
  const Bar bar(2);
  const Handles given{{Handle::point({-1, 0, 0}), Handle::point({1, 0, 0})}};
  const std::vector<DeformedShape> shapes{bar.moved(bent())};
  const auto rig = rig_from_shapes(bar.mesh, bar.surface, shapes, given, {.tolerance = 0.02});
  ASSERT_TRUE(rig) << rig.error().text();
  EXPECT_TRUE(rig->reached);
  EXPECT_LE(rig->poses[0].residual.relative(), 0.02);
  EXPECT_GT(rig->rounds.size(), 2u);
  EXPECT_LT(rig->rounds.back().relative, 0.3 * rig->rounds.front().relative);
  EXPECT_EQ(rig->rounds.front().handles, 2);
  EXPECT_EQ(rig->handles.count(), rig->W.cols());
  for (int b = 0; b < 2; ++b) EXPECT_EQ(rig->handles.handles[b].from, given.handles[b].from);
}

// Handles are added where the shape is missed: each round is nearer to it than the one before, down to the tolerance.
TEST(RigFromShapes, ResidualFallsWithEveryRound) {
  const Bar bar(2);
  Dent pushed{.direction = -Vec3::UnitY(), .face = -0.2, .depth = 0.15, .zone = 0.4, .swell = 0.2};
  pushed.footprint = Vec3(0.4, 1e9, 1e9);
  const std::vector<DeformedShape> shapes{bar.moved(bent()), bar.moved(dent(pushed))};
  const auto rig = rig_from_shapes(bar.mesh, bar.surface, shapes, {}, {.tolerance = 1e-3, .most_handles = 40});
  ASSERT_TRUE(rig) << rig.error().text();
  ASSERT_GT(rig->rounds.size(), 5u);
  for (size_t k = 0; k < rig->rounds.size(); ++k) {
    if (k == 0) continue;
    EXPECT_LT(rig->rounds[k].relative, rig->rounds[k - 1].relative) << rig->rounds[k].handles;
  }
}

TEST(RigFromShapes, SaysSoWhereTheToleranceIsOutOfReach) {
  const Bar bar(2);
  DeformedShape torn = bar.moved(bent());  // a spike that no smooth weights make
  torn.vertices[7] += Vec3(0, 3, 0);
  const auto rig = rig_from_shapes(bar.mesh, bar.surface, {torn}, {}, {.tolerance = 1e-5, .most_handles = 10});
  ASSERT_TRUE(rig) << rig.error().text();
  EXPECT_FALSE(rig->reached);
  EXPECT_EQ(rig->rounds.back().handles, 10);
  EXPECT_GT(rig->poses[0].residual.relative(), 1e-5);
  double best = 1e9;
  for (const auto& round : rig->rounds) best = std::min(best, round.relative);
  EXPECT_EQ(rig->poses[0].residual.relative(), best);
}

TEST(RigFromShapes, BadInputIsAnError) {
  const Bar bar(2);
  const auto of = [&](const std::vector<DeformedShape>& shapes, const ShapeRigOptions& options) {
    const auto rig = rig_from_shapes(bar.mesh, bar.surface, shapes, {}, options);
    return rig ? std::string("no error") : rig.error().text();
  };
  EXPECT_THAT(of({}, {}), HasSubstr("shapes is empty"));
  EXPECT_THAT(of({{"few", {Vec3::Zero()}}}, {}), HasSubstr("shapes[0].vertices holds 1 vertices"));
  EXPECT_THAT(of({{"rest", bar.surface.vertices}}, {.tolerance = 0}), HasSubstr("tolerance is 0"));
  EXPECT_THAT(of({{"rest", bar.surface.vertices}}, {.most_handles = 0}), HasSubstr("most_handles is 0"));
}

}  // namespace
}  // namespace crumple::authoring
