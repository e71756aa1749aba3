// Bodies drawn in splinters, and the dust of what breaks.
#include "server/authoring/shapes/box_lattice.h"
#include "server/authoring/splinter_cut.h"
#include "tests/sim/world/world_bodies.h"

#include <set>

namespace crumple::sim {
namespace {

std::shared_ptr<const SplinterMesh> stones(const TetMesh& mesh, double size) {
  const SurfaceMesh surface = authoring::surface_of(mesh);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices) box.extend(p);
  return std::make_shared<SplinterMesh>(
      *authoring::cut_splinters(*authoring::polyhedron_of(surface), *authoring::stone_cells(box, size, 1)));
}

// A free pane of 0.8 x 0.8 x 0.1 m that a ball goes through.
SceneDescription shot_at_pane(bool splinters, double dust = 0) {
  BodyDescription pane = soft_block("pane", {8, 8, 1}, 0.1, at(-0.4, -0.4, 0), Vec3::Zero(), 1e7);
  auto& model = std::get<FemModel>(pane.model);
  model.material.breakable = true;
  model.material.toughness = 2e4;
  model.material.dust = dust;
  if (splinters) model.splinters = stones(*model.mesh, 0.06);
  return empty_space({pane, ball("ball", 0.1, 5, at(0.02, 0.01, -0.15), Vec3(0, 0, 30))});
}

double area(const BodyTopology& drawn) {
  double sum = 0;
  for (const Triangle& t : drawn.triangles) {
    const Vec3 a = drawn.vertices[t[0]].cast<double>(), b = drawn.vertices[t[1]].cast<double>(), c = drawn.vertices[t[2]].cast<double>();
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

TEST(Splinters, AnUnbrokenBodyShowsItsOutsideAlone) {
  auto world = make_world(shot_at_pane(true));
  const BodyTopology& drawn = world->topology().bodies[0];
  EXPECT_NEAR(area(drawn), 2 * 0.64 + 4 * 0.08, 1e-5);  // floats
  std::set<std::array<float, 3>> places;
  for (const Vec3f& p : drawn.vertices) places.insert({p.x(), p.y(), p.z()});
  EXPECT_LT(drawn.vertices.size(), 1.02 * static_cast<double>(places.size()));  // what pieces have in common is sent once
}

TEST(Splinters, DoNotChangeWhatTheyAreDrawnOf) {
  auto plain = make_world(shot_at_pane(false)), drawn = make_world(shot_at_pane(true));
  for (int k = 0; k < 30; ++k) {
    plain->step();
    drawn->step();
  }
  EXPECT_GT(plain->fem(0).fragments, 3);
  EXPECT_EQ(plain->state_hash(), drawn->state_hash());
}

// Edges of what is drawn, beside what the tets themselves are stretched by.
TEST(Splinters, KeepTheirSizeWhileTheBodyFliesApart) {
  const SceneDescription scene = shot_at_pane(true);
  auto world = make_world(scene);
  for (int k = 0; k < 60; ++k) {
    world->step();
    const Topology& topology = world->topology();
    const Frame frame = world->capture(true);
    ASSERT_EQ(frame.bodies[0].positions.size(), topology.bodies[0].vertices.size());
    ASSERT_EQ(frame.bodies[0].values.size(), topology.bodies[0].vertices.size());
    for (const Triangle& t : topology.bodies[0].triangles) {
      for (int e = 0; e < 3; ++e) {
        const Vec3f d = frame.bodies[0].positions[t[e]] - frame.bodies[0].positions[t[(e + 1) % 3]];
        ASSERT_LT(d.norm(), 0.3f) << k;  // a splinter is 0.06 wide; the pieces are metres apart in the end
      }
    }
  }
  const FemView view = world->fem(0);
  EXPECT_GT(view.fragments, 5);
  EXPECT_GT(view.rigid_fragments, 0);
  Eigen::AlignedBox3d box;
  for (const Vec3& x : view.x) box.extend(x);
  EXPECT_GT(box.sizes().maxCoeff(), 2);
}

TEST(Splinters, WhatIsTornShowsItsInside) {
  auto world = make_world(shot_at_pane(true));
  const double before = area(world->topology().bodies[0]);
  while (world->fem(0).fragments < 3) world->step();
  EXPECT_GT(area(world->topology().bodies[0]), 1.05 * before);
}

TEST(Dust, LeavesWhatBreaksInProportionToItsSurfaceAndChangesNothing) {
  const double density = 100;
  auto world = make_world(shot_at_pane(false, density)), none = make_world(shot_at_pane(false));
  int grains = 0, torn = 0;
  for (int k = 0; k < 40; ++k) {
    const std::size_t before = world->topology().bodies[0].triangles.size();
    world->step();
    none->step();
    for (const Event& event : none->take_events()) EXPECT_NE(event.kind, EventKind::dust);
    int now = 0;
    for (const Event& event : world->take_events()) {
      if (event.kind != EventKind::dust) continue;
      EXPECT_EQ(event.count, static_cast<int>(event.particles.size()));
      EXPECT_LE(event.count, 400);
      now += event.count;
      const Frame frame = world->capture(false);
      for (const DustParticle& grain : event.particles) {
        float nearest = 1;  // a grain lies in a triangle of the surface: no further from a corner than a tet is long
        for (const Vec3f& p : frame.bodies[0].positions) nearest = std::min(nearest, (p - grain.position).norm());
        EXPECT_LT(nearest, 0.15f);
        EXPECT_LT(grain.velocity.norm(), 60);
      }
    }
    if (now == 400) continue;  // no more in a step
    grains += now;
    torn += static_cast<int>(world->topology().bodies[0].triangles.size() - before);
  }
  // Half of a square of 0.1 m, or of a rectangle of 0.1 m x 0.141 m; stretched by some percent when they tear.
  EXPECT_GT(torn, 200);
  EXPECT_GT(grains, 0.95 * density * 0.005 * torn);
  EXPECT_LT(grains, 1.3 * density * 0.00707 * torn);
  EXPECT_EQ(world->state_hash(), none->state_hash());
}

}  // namespace
}  // namespace crumple::sim
