#include "server/sim/example_based/kept_volume.h"

#include "server/sim/example_based/deform.h"
#include "tests/sim/example_based/bar_fixture.h"

#include <cstring>

namespace crumple::sim::example_based {
namespace {

constexpr double kMass = 500;  // [kg]

// A cube of 1 m whose eight corners are bones with trilinear weights, so that examples that stretch it are exact.
// scales: one example each, about the middle of the bottom.
std::shared_ptr<ExampleSet> block(const std::vector<Vec3>& scales) {
  const TetMesh mesh = bar_mesh({4, 4, 4}, 0.25);
  std::vector<Vec3> corners;
  for (int c = 0; c < 8; ++c) corners.push_back(Vec3(c & 1 ? 0.5 : -0.5, c & 2 ? 0.5 : -0.5, c & 4 ? 0.5 : -0.5));
  std::vector<std::vector<BoneTransform>> poses;
  for (const Vec3& scale : scales) {
    std::vector<BoneTransform> pose;
    for (const Vec3& corner : corners) {
      const Vec3 from_bottom = corner + 0.5 * Vec3::UnitY();
      pose.push_back({Quat::Identity(), Vec3(scale.cwiseProduct(from_bottom) - from_bottom)});
    }
    poses.push_back(pose);
  }
  auto set = make_set(mesh, corners, poses);
  for (int i = 0; i < set->vertex_count(); ++i)
    for (int c = 0; c < 8; ++c) {
      set->W(i, c) = 1;
      for (int k = 0; k < 3; ++k) set->W(i, c) *= corners[c][k] > 0 ? set->mesh.X[i][k] + 0.5 : 0.5 - set->mesh.X[i][k];
    }
  return set;
}

struct Pressed {
  ExampleRest rest;
  ExampleState state;

  // One blow of `impulse` [N s] down on the middle of the top.
  Pressed(std::shared_ptr<ExampleSet> set, bool keep_volume, double impulse, double gamma = 3, int threads = 1)
      : rest(make_rest(std::move(set))) {
    ExampleParameters p;
    p.gamma = gamma;
    p.keep_volume = keep_volume;
    state = make_state(rest, p);
    ExampleWorkspace work;
    const ThreadPool pool(threads);
    for (int k = 0; k < 400; ++k) {
      std::vector<VertexImpulse> blow;
      if (k == 0) blow.push_back({top(), Vec3(0, -impulse, 0)});
      deform(rest, p, {.dt = 0.004, .rate_dt = 0.004}, kMass, blow, pool, state, work);
    }
    EXPECT_TRUE(is_at_rest(state));
    EXPECT_LT(simplex_error(state.E), 1e-12);
  }

  int top() const {
    int best = 0;
    for (int i = 0; i < rest.vertex_count(); ++i)
      if ((rest.x_rest[i] - Vec3(0, 0.5, 0)).norm() < (rest.x_rest[best] - Vec3(0, 0.5, 0)).norm()) best = i;
    return best;
  }
  double lost() const { return 1 - shape_volume(rest.set->mesh, state.x) / shape_volume(rest.set->mesh, rest.x_rest); }
  double depth() const { return rest.x_rest[top()].y() - state.x[top()].y(); }  // [m]
};

const std::vector<Vec3> kSquashAndBulge{{1, 0.6, 1}, {1.5, 1, 1}, {1, 1, 1.5}};

TEST(KeptVolume, IsThatOfTheMeshAtRestAndOfAStretchedBlock) {
  const ExampleRest rest = make_rest(block(kSquashAndBulge));
  EXPECT_NEAR(shape_volume(rest.set->mesh, rest.x_rest), 1, 1e-12);
  std::vector<Vec3> x;
  for (int i = 0; i < rest.vertex_count(); ++i) x.push_back(skin_in_example(rest, i, 1));
  EXPECT_NEAR(shape_volume(rest.set->mesh, x), 0.6, 1e-12);
}

TEST(KeptVolume, WhatIsPressedInBulgesOutAndStaysPressedIn) {
  for (const double impulse : {400.0, 800.0}) {
    const Pressed plain(block(kSquashAndBulge), false, impulse), kept(block(kSquashAndBulge), true, impulse);
    std::printf("blow of %.0f N s: depth %.1f mm, volume lost %.2f %%; kept: depth %.1f mm, volume lost %.2f %%\n", impulse, 1e3 * plain.depth(),
                1e2 * plain.lost(), 1e3 * kept.depth(), 1e2 * kept.lost());
    ASSERT_GT(plain.lost(), 0.04);
    EXPECT_LT(std::abs(kept.lost()), 0.1 * plain.lost());  // the deeper one has used up the weights of rest
    EXPECT_NEAR(kept.depth(), plain.depth(), 0.1 * plain.depth());
  }
}

// The upper half, sides included. (Nearer the blow than that there is only the top, which these examples do not raise.)
TEST(KeptVolume, LocalDentsBulgeWhereTheyAre) {
  const Pressed plain(block(kSquashAndBulge), false, 800, 1.2), kept(block(kSquashAndBulge), true, 800, 1.2);
  std::printf("local: volume lost %.3f %%, kept %.3f %%\n", 1e2 * plain.lost(), 1e2 * kept.lost());
  EXPECT_LT(std::abs(kept.lost()), 0.8 * plain.lost());
  for (int i = 0; i < kept.rest.vertex_count(); ++i) {
    if (plain.state.E(i, 0) == 1) {
      EXPECT_EQ(kept.state.x[i], kept.rest.x_rest[i]);
    }
  }
}

TEST(KeptVolume, WhereTheExamplesDoNotAllowItNothingIsUndone) {
  const Pressed plain(block({{1, 0.6, 1}}), false, 800), kept(block({{1, 0.6, 1}}), true, 800);
  ASSERT_GT(plain.lost(), 0.04);
  EXPECT_NEAR(kept.depth(), plain.depth(), 1e-9);
  EXPECT_NEAR(kept.lost(), plain.lost(), 1e-9);
}

TEST(KeptVolume, BitsDoNotDependOnThreads) {
  const Pressed one(block(kSquashAndBulge), true, 800), two(block(kSquashAndBulge), true, 800, 3, 2);
  EXPECT_EQ(std::memcmp(one.state.E.data(), two.state.E.data(), sizeof(double) * one.state.E.size()), 0);
}

}  // namespace
}  // namespace crumple::sim::example_based
