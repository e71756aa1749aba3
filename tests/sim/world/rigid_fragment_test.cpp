// Small pieces that go on as rigid bodies: alone, and in whole worlds.
#include "server/sim/bodies/rigid_fragment.h"
#include "server/sim/fracture/fragments.h"
#include "tests/sim/world/world_bodies.h"

#include <Eigen/Eigenvalues>

namespace crumple::sim {
namespace {

// A lattice of 2 x 1 x 1 cells, bent and turning, with lumped masses.
RigidFragment::Piece tumbling_piece() {
  const TetMesh mesh = test::kuhn_lattice({2, 1, 1}, 0.1);
  RigidFragment::Piece piece{.tets = mesh.tets, .X = mesh.X};
  piece.tet_mass.assign(mesh.tets.size(), 0.2);
  piece.plastic_strain.assign(mesh.tets.size(), Mat3::Zero());
  piece.node_mass.assign(mesh.X.size(), 0);
  for (const Tet& tet : mesh.tets)
    for (const int n : tet) piece.node_mass[n] += 0.05;
  for (const Vec3& X : mesh.X) {
    piece.x.push_back(Vec3(1, 2, 3) + X + Vec3(0, 0.5 * X.x() * X.x(), 0));
    piece.v.push_back(Vec3(2, -1, 0.5) + Vec3(3, 7, -5).cross(piece.x.back()) + Vec3(0, 0, X.x()));
  }
  return piece;
}

struct Momenta {
  Vec3 p = Vec3::Zero(), L = Vec3::Zero();
};
Momenta momenta(const RigidFragment::Piece& piece) {
  Momenta sum;
  for (std::size_t n = 0; n < piece.x.size(); ++n) {
    sum.p += piece.node_mass[n] * piece.v[n];
    sum.L += piece.node_mass[n] * piece.x[n].cross(piece.v[n]);
  }
  return sum;
}
Momenta momenta(const RigidFragment& fragment) {
  const Vec3 p = fragment.mass() * fragment.velocity();
  return {p, fragment.angular_momentum() + fragment.com().cross(p)};
}

TEST(RigidFragment, HasThePlaceAndTheMomentaOfThePieceThatItWas) {
  const RigidFragment::Piece piece = tumbling_piece();
  const RigidFragment fragment(piece);
  EXPECT_NEAR(fragment.mass(), 12 * 0.2, 1e-15);
  EXPECT_EQ(fragment.x(), piece.x);
  const Momenta before = momenta(piece), after = momenta(fragment);
  EXPECT_LT((after.p - before.p).norm(), 1e-14 * before.p.norm());
  EXPECT_LT((after.L - before.L).norm(), 1e-14 * before.L.norm());
  // Nodes have the velocities of a rigid body with these momenta.
  RigidFragment::Piece rigid = piece;
  for (int n = 0; n < fragment.node_count(); ++n) rigid.v[n] = fragment.node_velocity(n);
  EXPECT_LT((momenta(rigid).L - before.L).norm(), 1e-13 * before.L.norm());
}

// Free rotation: angular momentum stays for ever, shape too; energy stays within what a first-order step of Euler's
// equations leaves.
TEST(RigidFragment, TumblesWithItsAngularMomentum) {
  RigidFragment fragment(tumbling_piece());
  const Vec3 L = fragment.angular_momentum();
  const double length = (fragment.x()[0] - fragment.x()[5]).norm(), energy = fragment.kinetic_energy();
  for (int k = 0; k < 600; ++k) fragment.advance(fragment.velocity(), fragment.angular_velocity(), 1.0 / 60);
  EXPECT_LT((fragment.angular_momentum() - L).norm(), 1e-9 * L.norm());
  EXPECT_NEAR((fragment.x()[0] - fragment.x()[5]).norm(), length, 1e-12);
  EXPECT_NEAR(fragment.kinetic_energy(), energy, 0.02 * energy);
}

TEST(RigidFragment, IsHeldWhereItWasWhenItsVelocityIsNotFinite) {
  RigidFragment fragment(tumbling_piece());
  const std::vector<Vec3> x = fragment.x();
  fragment.advance(Vec3(std::nan(""), 0, 0), Vec3::Zero(), 0.1);
  EXPECT_TRUE(fragment.is_held());
  EXPECT_EQ(fragment.x(), x);
  EXPECT_EQ(fragment.velocity(), Vec3::Zero());
  fragment.advance(Vec3(1, 0, 0), Vec3::Zero(), 0.1);
  EXPECT_EQ(fragment.x(), x);
}

// ---- in worlds ---------------------------------------------------------------------------------------------------

SceneDescription shattered_on_the_ground(int rigid_fragments, double ball_z = -0.03) {
  BodyDescription pane = soft_block("pane", {8, 8, 1}, 0.1, at(-0.4, 0.3, 0.4), Vec3::Zero(), 1e7);
  auto& model = std::get<FemModel>(pane.model);
  pane.pose.R_WB = Quat(Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitX()));
  model.material.breakable = true;
  model.material.toughness = 2e4;
  model.material.cg_tolerance = 1e-4;
  model.rigid_fragments = rigid_fragments;
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.bodies = {pane, ball("ball", 0.1, 20, at(0.02, 0.9, ball_z), Vec3(0, -15, 0)), ground()};
  return scene;
}

TEST(RigidFragments, PiecesOfABrokenPaneComeToRestAndSleep) {
  const double mass = 1000 * 0.8 * 0.8 * 0.1;
  for (const double ball_z : {-0.05, -0.03, 0.0}) {  // where it strikes: another heap each time
    auto world = make_world(shattered_on_the_ground(9, ball_z));
    int most = 0;
    for (int k = 0; k < 60 * 40 && world->workload().live_bodies > 0; ++k) {
      world->step();
      most = std::max(most, world->fem(0).rigid_fragments);
      for (const Vec3& x : world->fem(0).x) ASSERT_GT(x.y(), -0.1) << k;
    }
    EXPECT_GT(most, 3);
    EXPECT_EQ(world->workload().live_bodies, 0) << ball_z;
    EXPECT_EQ(world->workload().rigid_fragments, most);
    const FemView view = world->fem(0);
    EXPECT_EQ(view.tets.size(), 8u * 8 * 6);
    EXPECT_EQ(view.v.size(), view.x.size());
    EXPECT_EQ(view.von_mises.size(), view.tets.size());
    EXPECT_NEAR(-world->energies().gravitational / 9.81, -(mass * world->pose(0).p_WB.y() + 20 * world->pose(1).p_WB.y()), 1e-6);
  }
}

TEST(RigidFragments, SleepOneByOneAndWakeOneByOne) {
  SceneDescription scene = shattered_on_the_ground(9);
  for (const int b : {0, 1}) scene.bodies[b].pose.p_WB.y() += 1.5;  // pieces that scatter, not a heap
  std::get<RigidModel>(scene.bodies[1].model).shapes = {{Pose{}, Box{Vec3::Constant(0.1)}}};  // a ball would roll among them
  auto world = make_world(scene);
  bool some = false;
  for (int k = 0; k < 60 * 40 && world->workload().live_bodies > 0; ++k) {
    const Workload load = world->step().workload;
    if (load.asleep_fragments == 0 || load.asleep_fragments == load.rigid_fragments) continue;
    some = true;
    EXPECT_FALSE(world->is_asleep(0));
  }
  EXPECT_TRUE(some);
  ASSERT_TRUE(world->is_asleep(0));
  const FemView lying = world->fem(0);
  ASSERT_EQ(world->workload().asleep_fragments, lying.rigid_fragments);

  // The last fragment, lifted: others stay where they are, to the bit.
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, 30, 0), .point = lying.x.back(), .radius = 1e-6}));
  const Workload load = world->step().workload;
  EXPECT_FALSE(world->is_asleep(0));
  EXPECT_LT(load.asleep_fragments, lying.rigid_fragments);
  EXPECT_GT(load.asleep_fragments, 0);
  const FemView after = world->fem(0);
  const auto top = [](const FemView& view) {  // nodes are not where they were: what wakes may break further
    return std::ranges::max(view.x, {}, [](const Vec3& x) { return x.y(); }).y();
  };
  EXPECT_GT(top(after), top(lying) + 0.1);
  int stayed = 0;
  for (std::size_t n = 0; n < lying.x.size(); ++n) stayed += after.x[n] == lying.x[n];
  EXPECT_GT(stayed, 0);
}

TEST(RigidFragments, NoneWhereTheSceneSaysSo) {
  auto world = make_world(shattered_on_the_ground(0));
  for (int k = 0; k < 60; ++k) world->step();
  EXPECT_GT(world->fem(0).fragments, 3);
  EXPECT_EQ(world->fem(0).rigid_fragments, 0);
}

TEST(RigidFragments, ArePushedByCommandsAndDrawnAsTheyWere) {
  auto world = make_world(shattered_on_the_ground(9));
  while (world->time() < 1 && world->fem(0).rigid_fragments < 3) world->step();
  ASSERT_GE(world->fem(0).rigid_fragments, 3);
  const FemView before = world->fem(0);
  EXPECT_EQ(before.fragments, fracture::find_fragments(before.tets).count());
  // A node of the scene's mesh keeps its number, wherever it is now.
  std::vector<int> all;
  for (int n = 0; n < 9 * 9 * 2; ++n) all.push_back(n);
  const Energies at_start = world->energies();
  // Whatever split or left: of the scene's mesh, and no others.
  const auto beyond = world->submit(ApplyNodeImpulse{.body = 0, .nodes = {9 * 9 * 2}, .impulse = Vec3(1, 0, 0)});
  ASSERT_FALSE(beyond);
  EXPECT_NE(beyond.error().text().find("must be in [0, 162)"), std::string::npos) << beyond.error().text();
  const auto pushed = world->submit(ApplyNodeImpulse{.body = 0, .nodes = all, .impulse = Vec3(640, 0, 0)});
  ASSERT_TRUE(pushed) << pushed.error().text();
  world->step();
  EXPECT_GT(world->energies().momentum.x() - at_start.momentum.x(), 0.5 * 640);  // friction takes the rest
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, 200, 0), .point = before.x.back(), .radius = 0.3}));
  EXPECT_NO_FATAL_FAILURE(world->step());
  const Frame frame = world->capture(true);
  EXPECT_EQ(frame.bodies[0].positions.size(), world->topology().bodies[0].vertices.size());
}

TEST(RigidFragments, SameBitsWithTwoThreads) {
  auto one = make_world(shattered_on_the_ground(9), 1), two = make_world(shattered_on_the_ground(9), 2);
  for (int k = 0; k < 40; ++k) {
    one->step();
    two->step();
    ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
  }
  EXPECT_GT(one->fem(0).rigid_fragments, 0);
}

}  // namespace
}  // namespace crumple::sim
