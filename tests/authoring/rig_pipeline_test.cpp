#include "server/authoring/rig_pipeline.h"

#include "server/authoring/painted_regions.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/shapes/surfaces.h"
#include "tests/authoring/surfaces_for_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::BoneTransform;
using ::testing::HasSubstr;

// A block of 2 x 1 x 1 m about the origin.
ArtistMesh block() {
  ArtistMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.surface.vertices.emplace_back(k & 1 ? 1 : -1, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  mesh.surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

// With joints at both ends.
ArtistMesh jointed_block() {
  ArtistMesh mesh = block();
  mesh.handles = {{"left", Vec3(-1, 0, 0)}, {"right", Vec3(1, 0, 0)}};
  return mesh;
}

RigOptions coarse() { return {.enclosing = {.tet_budget = 600}}; }

TEST(RigPipeline, EnclosesEveryVertexAndCrushesEverySide) {
  std::vector<double> done;
  const auto made = make_asset(block(), coarse(), [&](double part, const std::string&) { done.push_back(part); });
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_EQ(made->report.vertices, 8);
  EXPECT_EQ(made->report.vertices_enclosed, 8);
  EXPECT_EQ(made->report.automatic_handles, kDefaultHandles);
  EXPECT_EQ(made->set.example_count(), 7);
  EXPECT_LE(made->report.tets, 600);
  EXPECT_TRUE(std::ranges::is_sorted(done));
  EXPECT_EQ(done.back(), 1);
}

TEST(RigPipeline, KeepsTheLatticeWhereAskedTo) {
  RigOptions options = coarse();
  options.keep_lattice = true;
  const auto made = make_asset(block(), options);
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_EQ(made->report.vertices_enclosed, 8);
}

// Joint to child along x from -1 to 1: a bone that holds all along it, so that nothing is left to the child but its end.
TEST(RigPipeline, JointsAreBonesWhereAskedTo) {
  ArtistMesh mesh = jointed_block();
  mesh.parents = {-1, 0};
  mesh.weights.resize(0, 0);
  RigOptions options = coarse();
  const auto points = make_asset(mesh, options);
  options.joints = RigOptions::Joints::bones;
  const auto bones = make_asset(mesh, options);
  ASSERT_TRUE(points && bones);
  EXPECT_EQ(points->report.bones, 0);
  EXPECT_EQ(bones->report.bones, 1);
  EXPECT_EQ(bones->set.handles[1].name, "right");
  EXPECT_GT(bones->set.W.col(0).mean(), 0.8);
  EXPECT_LT(points->set.W.col(0).mean(), 0.6);
}

TEST(RigPipeline, PutsAutomaticHandlesBesideThoseGiven) {
  RigOptions options = coarse();
  options.handles.points = {{"middle", Vec3(0, 0.5, 0)}};
  options.automatic_handles = 5;
  const auto made = make_asset(jointed_block(), options);
  ASSERT_TRUE(made) << made.error().text();
  ASSERT_EQ(made->set.handles.size(), 8u);
  EXPECT_EQ(made->set.handles[2].name, "middle");
  EXPECT_EQ(made->set.handles[3].name, "auto 1");
  EXPECT_EQ(made->report.given_handles, 3);
  EXPECT_EQ(made->report.automatic_handles, 5);
  for (std::size_t a = 3; a < 8; ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT((made->set.handles[a].position - made->set.handles[b].position).norm(), 0.3)
          << made->set.handles[a].name << " " << made->set.handles[b].name;
}

// Joints that all move as one carry all of the body so, automatic handles too.
TEST(RigPipeline, ARigidMotionOfTheJointsIsOneOfTheBody) {
  ArtistMesh mesh = jointed_block();
  const BoneTransform motion{Quat(Eigen::AngleAxisd(1.2, Vec3(1, 2, 3).normalized())), Vec3(0.1, -2, 3)};
  mesh.poses = {{"moved", {motion, motion}}};
  RigOptions options = coarse();
  options.automatic_handles = 6;
  const auto made = make_asset(mesh, options);
  ASSERT_TRUE(made) << made.error().text();
  ASSERT_EQ(made->set.example_count(), 2) << "no crushed poses beside others";
  const auto x = skinned(made->set, made->set.examples[1].bones);
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_LT((x[i] - (motion.q * made->set.mesh.X[i] + motion.t)).norm(), 1e-9);
}

TEST(RigPipeline, ACopyThatIsOnlyMovedIsFittedExactly) {
  ArtistMesh mesh = block();
  mesh.copies = {{"moved", mesh.surface.vertices}};
  for (Vec3& p : mesh.copies[0].vertices) p += Vec3(0.3, -0.2, 0.1);
  const auto made = make_asset(mesh, coarse());
  ASSERT_TRUE(made) << made.error().text();
  ASSERT_EQ(made->report.examples.size(), 1u);
  EXPECT_EQ(made->report.examples[0].source, ExampleReport::Source::copy);
  EXPECT_LT(made->report.examples[0].residual_largest, 1e-9);  // vertices outside of the tets are carried along too
}

// One end of the block drawn out to twice its width: residuals say what is left.
TEST(RigPipeline, ReportsWhatAFitLeaves) {
  ArtistMesh mesh = block();
  mesh.copies = {{"flared", mesh.surface.vertices}};
  for (Vec3& p : mesh.copies[0].vertices)
    if (p.x() > 0) p.y() *= 2, p.z() *= 2;
  const double moved = std::sqrt(0.5);
  const auto made = make_asset(mesh, coarse());
  ASSERT_TRUE(made) << made.error().text();
  const ExampleReport& report = made->report.examples[0];
  EXPECT_GT(report.residual_rms, 0);
  EXPECT_LE(report.residual_rms, report.residual_largest);
  EXPECT_LT(report.residual_largest, 0.6 * moved);
  // Eight corners say nothing of what is between them; the fit is to the sides as they are drawn.
  const auto x = skinned(made->set, made->set.examples[1].bones);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((x[i] - made->set.mesh.X[i]).norm(), 1.5 * moved);
}

TEST(SurfaceSamples, LeaveNoPointOfTheSurfaceFarFromOne) {
  const sim::SurfaceMesh box = box_surface({1, 0.5, 0.05});
  const SurfaceSamples samples(box, 0.2);
  const auto at = samples.at(box.vertices);
  ASSERT_EQ(static_cast<int>(at.size()), samples.count());
  for (std::size_t v = 0; v < box.vertices.size(); ++v) EXPECT_EQ(at[v], box.vertices[v]);
  for (double x = -1; x <= 1; x += 0.05)
    for (double y = -0.5; y <= 0.5; y += 0.05) {
      double nearest = 1;
      for (const Vec3& p : at) nearest = std::min(nearest, (p - Vec3(x, y, 0.05)).norm());
      EXPECT_LT(nearest, 0.2) << x << " " << y;
    }
  std::vector<Vec3> turned = box.vertices;
  const Mat3 R(Eigen::AngleAxisd(1, Vec3::UnitX()));
  for (Vec3& p : turned) p = R * p;
  const auto turned_at = samples.at(turned);
  for (std::size_t k = 0; k < at.size(); ++k) EXPECT_LT((turned_at[k] - R * at[k]).norm(), 1e-12);
}

// ---- handles added until the copies are met
TEST(RigPipeline, AddsHandlesUntilACopyIsMetToATolerance) {
  ArtistMesh mesh = jointed_block();
  mesh.surface = box_surface({1, 0.5, 0.5});
  mesh.copies = {{"flared", mesh.surface.vertices}};
  for (Vec3& p : mesh.copies[0].vertices)
    if (p.x() > 0) p.y() *= 2, p.z() *= 2;
  RigOptions options{.enclosing = {.tet_budget = 1500}};
  const auto before = make_asset(mesh, options);
  ASSERT_TRUE(before) << before.error().text();
  EXPECT_GT(before->report.examples[0].residual_relative, 0.5) << "two joints";
  options.tolerance = 0.2;
  const auto made = make_asset(mesh, options);
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_TRUE(made->report.tolerance_met);
  EXPECT_GT(made->report.rounds.size(), 2u);
  EXPECT_GT(made->report.examples[0].residual_relative, 0);
  EXPECT_LE(made->report.examples[0].residual_relative, 0.2);
  EXPECT_EQ(made->report.given_handles, 2);
  EXPECT_EQ(made->set.handles.size(), 2u + made->report.automatic_handles);
  EXPECT_EQ(made->set.handles[2].name, "auto 1");
  options.most_handles = 5;
  const auto few = make_asset(mesh, options);
  ASSERT_TRUE(few) << few.error().text();
  EXPECT_FALSE(few->report.tolerance_met);
  EXPECT_LE(few->set.handles.size(), 5u);
  EXPECT_THAT(few->report.warnings, testing::Contains(HasSubstr("tolerance of 0.2 is not met with 5 handles")));
}

TEST(RigPipeline, ColoursBecomeFactorsOfAlphaAndBeta) {
  ArtistMesh mesh = block();
  for (const Vec3& p : mesh.surface.vertices) mesh.colours.push_back(p.x() > 0 ? Vec3(1, 0, 0.5) : Vec3(0, 1, 0.75));
  RigOptions options = coarse();
  options.painted_regions = true;
  const auto made = make_asset(mesh, options);
  ASSERT_TRUE(made) << made.error().text();
  const auto& set = made->set;
  ASSERT_EQ(static_cast<int>(set.alpha_scale.size()), set.vertex_count());
  ASSERT_EQ(static_cast<int>(set.beta_scale.size()), set.vertex_count());
  for (int i = 0; i < set.vertex_count(); ++i) {
    // Linear along x between the ends: channel (x + 1) / 2, scale 2^(4 x).
    const double x = std::clamp(set.mesh.X[i].x(), -1.0, 1.0);
    if (std::abs(set.mesh.X[i].y()) < 0.49 && std::abs(set.mesh.X[i].z()) < 0.49)
      continue;  // inside: of whichever side is nearest
    EXPECT_NEAR(std::log2(set.alpha_scale[i]), 4 * x, 0.2);
    EXPECT_NEAR(std::log2(set.beta_scale[i]), 1 - x, 0.2);
  }
}

TEST(RigPipeline, ARegionsChannelAndScaleAreInverse) {
  EXPECT_DOUBLE_EQ(region_scale(0.5), 1);
  EXPECT_DOUBLE_EQ(region_scale(0), 1.0 / 16);
  EXPECT_DOUBLE_EQ(region_scale(1), 16);
  for (const double scale : {1.0 / 16, 0.3, 1.0, 5.0, 16.0})
    EXPECT_NEAR(region_scale(region_channel(scale)), scale, 1e-12 * scale);
  EXPECT_EQ(region_channel(0), 0);
  EXPECT_EQ(region_channel(1e6), 1);
}

TEST(RigPipeline, TakesPaintedWeights) {
  ArtistMesh mesh = jointed_block();
  mesh.weights.resize(8, 2);
  for (int v = 0; v < 8; ++v) mesh.weights.row(v) << (v & 1 ? 0.25 : 1), (v & 1 ? 0.75 : 0);
  mesh.poses = {{"pulled", {BoneTransform{}, {Quat::Identity(), Vec3(1, 0, 0)}}}};
  RigOptions options = coarse();
  const auto made = make_asset(mesh, options);
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_EQ(made->report.weights, RigOptions::Weights::painted) << "where the mesh has them";
  EXPECT_LT((made->set.W.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
  for (int i = 0; i < made->set.vertex_count(); ++i)
    if (made->set.mesh.X[i].x() > 1 - 1e-9) EXPECT_NEAR(made->set.W(i, 1), 0.75, 1e-9);

  // Another handle has none: all are computed, and a warning says so.
  options.automatic_handles = 2;
  const auto more = make_asset(mesh, options);
  ASSERT_TRUE(more) << more.error().text();
  EXPECT_EQ(more->report.weights, RigOptions::Weights::bounded_biharmonic);
  EXPECT_THAT(more->report.warnings, testing::Contains(HasSubstr("joint weights are left out")));
}

TEST(RigPipeline, APoseOfHandlesTakesTheOthersAlong) {
  RigOptions options = coarse();
  options.poses = {{"lifted", {{.handle = "left", .position = Vec3(-1, 2, 0)}}}};
  const auto made = make_asset(jointed_block(), options);
  ASSERT_TRUE(made) << made.error().text();
  for (const BoneTransform& bone : made->set.examples[1].bones) {
    EXPECT_LT((bone.t - Vec3(0, 2, 0)).norm(), 1e-9) << "one handle dragged alone takes the body with it";
    EXPECT_LT(bone.q.angularDistance(Quat::Identity()), 1e-6);
  }
  EXPECT_LT(made->report.examples[0].strain, 1e-6);
}

// The left end is held as it is, the right one dragged up: the block bends, so that the right end turns by about 3/2 of
// deflection over length, as a cantilever's does (less, because so short a one shears).
TEST(ExampleAuthor, ADraggedHandleTurnsAsABentBodyWould) {
  const auto made = make_asset(jointed_block(), coarse());
  ASSERT_TRUE(made) << made.error().text();
  auto set = made->set;
  const NamedPose dragged{
      "bent", {{.handle = "left", .rotation = Quat(2, 0, 0, 0)}, {.handle = "right", .position = Vec3(1, 0.4, 0)}}};
  const auto posed = ExampleAuthor(set).add_pose(dragged);
  ASSERT_TRUE(posed) << posed.error().text();
  EXPECT_TRUE(posed->converged);
  EXPECT_GT(posed->strain, 1e-3);
  const auto& left = set.examples.back().bones[0];
  const auto& right = set.examples.back().bones[1];
  EXPECT_LT(left.t.norm() + left.q.vec().norm(), 1e-12) << "given place and rotation are kept";
  EXPECT_LT((right.q * Vec3(1, 0, 0) + right.t - Vec3(1, 0.4, 0)).norm(), 1e-12);
  const Eigen::AngleAxisd turn(right.q);
  EXPECT_GT(turn.angle() * turn.axis().z(), 0.25 * 0.4 / 2);
  EXPECT_LT(turn.angle() * turn.axis().z(), 1.6 * 0.4 / 2);
}

TEST(ExampleAuthor, HandlesThatAreNotNamedAreFreeOrHeld) {
  RigOptions options = coarse();
  options.automatic_handles = 6;
  const auto made = make_asset(jointed_block(), options);
  ASSERT_TRUE(made) << made.error().text();
  auto set = made->set;
  ExampleAuthor author(set);
  const std::vector<HandleMove> moves{{.handle = "left", .position = Vec3(-1, 2, 0), .rotation = Quat(0, 0, 2, 0)}};
  ASSERT_TRUE(author.add_pose({"held", moves}, UnnamedHandles::held));
  ASSERT_TRUE(author.add_pose({"free", moves}));
  const auto &held = set.examples[set.examples.size() - 2].bones, &free = set.examples.back().bones;
  for (const auto& bones : {held, free}) {
    EXPECT_LT((bones[0].q * Vec3(-1, 0, 0) + bones[0].t - Vec3(-1, 2, 0)).norm(), 1e-12);
    EXPECT_LT(bones[0].q.angularDistance(Quat(0, 0, 1, 0)), 1e-12);
  }
  const BoneTransform rigid{Quat(0, 0, 1, 0), Vec3(-1, 2, 0) - Quat(0, 0, 1, 0) * Vec3(-1, 0, 0)};
  for (std::size_t b = 1; b < set.handles.size(); ++b) {
    EXPECT_LT(held[b].t.norm() + held[b].q.vec().norm(), 1e-12) << set.handles[b].name;
    EXPECT_LT((free[b].t - rigid.t).norm(), 1e-6) << set.handles[b].name << " goes along, the body stays rigid";
  }
}

// ---- weights
// Two arms along x, 0.7 m apart, and a base that joins them; handles at both tips and in the base.
ArtistMesh u_of_boxes() {
  ArtistMesh mesh;
  for (const auto& [size, centre] : {std::pair(Vec3(2.6, 0.3, 0.3), Vec3(0, 0.5, 0)),
                                     {Vec3(2.6, 0.3, 0.3), Vec3(0, -0.5, 0)},
                                     {Vec3(0.4, 1.3, 0.3), Vec3(-1.3, 0, 0)}}) {
    const int first = static_cast<int>(mesh.surface.vertices.size());
    const sim::SurfaceMesh box = box_surface(size / 2);
    for (const Vec3& p : box.vertices) mesh.surface.vertices.push_back(p + centre);
    for (const Triangle& t : box.triangles)
      mesh.surface.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  mesh.handles = {{"upper", Vec3(1.3, 0.5, 0)}, {"lower", Vec3(1.3, -0.5, 0)}, {"base", Vec3(-1.4, 0, 0)}};
  return mesh;
}

TEST(RigPipeline, WeightsDoNotLeakAcrossAGapUnlessTheyAreGaussian) {
  const auto leak = [](RigOptions::Weights weights) {
    RigOptions options{.enclosing = {.tet_budget = 2500}};
    options.weights = weights;
    const auto made = make_asset(u_of_boxes(), options);
    EXPECT_TRUE(made) << made.error().text();
    EXPECT_EQ(made->report.weights,
              weights == RigOptions::Weights::gaussian ? weights : RigOptions::Weights::bounded_biharmonic);
    double most = 0;  // of the lower tip's handle on the upper arm, and the other way round
    for (int i = 0; i < made->set.vertex_count(); ++i)
      if (const Vec3& X = made->set.mesh.X[i]; X.x() > 0.8) most = std::max(most, made->set.W(i, X.y() > 0 ? 1 : 0));
    return most;
  };
  EXPECT_LT(leak(RigOptions::Weights::by_mesh), 0.02);
  EXPECT_GT(leak(RigOptions::Weights::gaussian), 0.1);
}

TEST(RigPipeline, NamesWhatIsWrong) {
  const auto says = [](const ArtistMesh& mesh, const auto& change) {
    RigOptions options = coarse();
    ArtistMesh changed = mesh;
    change(options, changed);
    const auto made = make_asset(changed, options);
    return made ? std::string("nothing") : made.error().text();
  };
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.crush_depth = 0.7; }),
              HasSubstr("crush_depth is 0.7, must be in (0, 0.6]"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.convex_parts = 65; }), HasSubstr("convex_parts is 65"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.automatic_handles = 0; }),
              HasSubstr("automatic_handles is 0 and no handle is given"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.automatic_handles = 2000; }),
              HasSubstr("automatic_handles is 2000"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.painted_regions = true; }), HasSubstr("no vertex colours"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.weights = RigOptions::Weights::painted; }),
              HasSubstr("no joint weights"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.tolerance = 2; }), HasSubstr("tolerance is 2, must be in (0, 1]"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.tolerance = 0.1; }), HasSubstr("has no deformed copies"));
  EXPECT_THAT(says(block(),
                   [](auto& o, auto&) {
                     o.tolerance = 0.1;
                     o.weights = RigOptions::Weights::gaussian;
                   }),
              HasSubstr("must be with bounded biharmonic ones"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.most_handles = 0; }), HasSubstr("most_handles is 0"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.enclosing.cell_size = 1e-5; }), HasSubstr("cell_size is 1e-05"));
  EXPECT_THAT(says(block(), [](auto& o, auto&) { o.enclosing.cell_size = 3; }),
              HasSubstr("cell_size is 3 m, must be at most 2 m, the surface's longest side"));
  EXPECT_THAT(says(jointed_block(),
                   [](auto& o, auto&) {
                     o.poses = {{"up", {}}};
                   }),
              HasSubstr("poses[\"up\"].moves is empty, must name a handle"));
  EXPECT_THAT(says(jointed_block(),
                   [](auto& o, auto&) {
                     o.handles.points = {{"left", Vec3::Zero()}};
                   }),
              HasSubstr("\"left\" is the name of two handles"));
  EXPECT_THAT(says(jointed_block(),
                   [](auto& o, auto&) {
                     o.poses = {{"up", {{.handle = "rigth"}}}};
                   }),
              HasSubstr("poses[\"up\"].moves[0].handle is \"rigth\", which is no handle"));
  EXPECT_THAT(says(jointed_block(),
                   [](auto& o, auto&) {
                     o.poses = {{"up", {{.handle = "left"}, {.handle = "left"}}}};
                   }),
              HasSubstr("moved twice"));
  EXPECT_THAT(says(block(),
                   [](auto&, auto& m) {
                     m.copies = {{"short", {Vec3::Zero()}}};
                   }),
              HasSubstr("\"short\" has 1 vertices, must have 8"));
  EXPECT_THAT(says(block(),
                   [](auto&, auto& m) {
                     m.copies = {{"a", m.surface.vertices}, {"a", m.surface.vertices}};
                   }),
              HasSubstr("\"a\" is the name of two examples"));
  EXPECT_THAT(says(jointed_block(),
                   [](auto&, auto& m) {
                     for (int k = 0; k < 64; ++k)
                       m.poses.push_back({"p" + std::to_string(k), {BoneTransform{}, BoneTransform{}}});
                   }),
              HasSubstr("\"p63\" is one example too many"));
}

TEST(RigPipeline, SaysWhereThereIsNoPlaceForSoManyHandles) {
  RigOptions options = coarse();
  options.automatic_handles = 1000;
  const auto made = make_asset(block(), options);
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_LT(made->report.automatic_handles, 1000);
  EXPECT_EQ(static_cast<int>(made->set.handles.size()), made->report.automatic_handles);
  EXPECT_THAT(made->report.warnings, testing::ElementsAre(HasSubstr("of 1000 automatic handles are there")));
}

TEST(RigPipeline, WarnsOfHandlesFarOutside) {
  ArtistMesh mesh = jointed_block();
  mesh.handles[1].position = Vec3(30, 0, 0);
  const auto made = make_asset(mesh, coarse());
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_THAT(made->report.warnings, testing::ElementsAre(HasSubstr("handle \"right\" is 2")));
}

}  // namespace
}  // namespace crumple::authoring
