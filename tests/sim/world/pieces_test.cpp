// Large pieces of a broken finite-element body: meshes of their own from the end of the step in which they came apart.
#include "server/sim/bodies/soft_body.h"
#include "tests/sim/fem/fem_test_support.h"
#include "tests/sim/world/world_bodies.h"

#include <Eigen/SparseLU>

#include <algorithm>
#include <set>
#include <tuple>

namespace crumple::sim {
namespace {

constexpr double kDt = 1.0 / 60;

// ---- by themselves -----------------------------------------------------------------------------------------------

enum class Kind { plain, two_materials, octahedra, nearly_incompressible_octahedra, hexahedra };

class Parting : public testing::TestWithParam<std::tuple<Kind, Integrator>> {
 protected:
  // A bar of which a sixth is held and moved by a script.
  static FemModel bar(Kind kind) {
    FemModel model = std::get<FemModel>(soft_block("bar", {12, 2, 2}, 0.1, Pose{}).model);
    model.material = {.young = 1e6, .poisson = kind == Kind::nearly_incompressible_octahedra ? 0.48 : 0.3, .density = 1000};
    model.material.damping_stiffness = 0.002;
    model.material.breakable = true;
    model.material.toughness = 5e3;
    model.rigid_fragments = 0;
    if (kind != Kind::hexahedra) model.material.yield = 0.01, model.material.creep = 0.2;
    if (kind == Kind::octahedra || kind == Kind::nearly_incompressible_octahedra) model.element = fem::ElementKind::smoothed_octahedra;
    if (kind == Kind::hexahedra) model.element = fem::ElementKind::hexahedra;
    if (kind == Kind::two_materials) {
      model.regions.push_back({.material = model.material});
      for (int t = 0; t < model.mesh->tet_count(); ++t)
        if (std::ranges::all_of(model.mesh->tets[t], [&](int n) { return model.mesh->X[n].y() < 0.11; })) model.regions[0].tets.push_back(t);
      model.regions.back().material.young = 3e6;
      model.regions.back().material.damping_mass = 1;
    }
    NodeMotion held{.keys = {{0, Pose{}}, {10, at(-0.5, 0.2, 0)}}};
    for (int n = 0; n < static_cast<int>(model.mesh->X.size()); ++n)
      if (model.mesh->X[n].x() < 0.15) held.nodes.push_back(n);
    model.motions.push_back(held);
    return model;
  }
};

// One step without contact, solved to rounding.
void step(SoftBody& body, double time, const ThreadPool& pool) {
  body.prescribe(time, kDt);
  body.assemble(Vec3(0, -1, 0), kDt, pool);
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(body.system.to_sparse());
  const Eigen::VectorXd v = body.system.guess + lu.solve(body.system.b - body.system.to_sparse() * body.system.guess);
  ASSERT_TRUE(body.advance(v, kDt));
  body.plastic_flow(kDt, kDt, pool);
}

// What pieces do by themselves is what they did as one mesh: of whatever elements, materials and formula, held, driven or free.
TEST_P(Parting, ChangesNothingOfTheirMotion) {
  const auto [kind, integrator] = GetParam();
  const FemModel model = bar(kind);
  BodyDescription description;
  auto made = SoftBody::make(0, description, model, {.dt = kDt, .integrator = integrator, .float_solver = false}, "bodies[0].fem");
  ASSERT_TRUE(made) << made.error().text();
  SoftBody& body = *made;
  const ThreadPool pool(1);
  // Torn in two near its middle.
  for (int n = 0; n < body.node_count(); ++n) body.state.v[n] = Vec3(body.X[n].x() > 0.6 ? 10 : 0, 0, 0.5 * body.X[n].x());
  double time = 0;
  SoftBody whole = body;
  SoftBody::HandOver moved;
  for (int k = 0; k < 40 && moved.meshes.empty(); ++k, time += kDt) {
    step(body, time, pool);
    body.fracture(7, k, pool);
    whole = body;
    moved = body.hand_over(pool);
    if (moved.meshes.empty()) ASSERT_EQ(moved.count(), 0);
  }
  ASSERT_FALSE(moved.meshes.empty());
  std::vector<SoftBody*> pieces{&body};
  for (SoftBody& mesh : moved.meshes) pieces.push_back(&mesh);
  std::size_t tets = 0, driven = 0;
  double mass = 0;
  for (const SoftBody* piece : pieces) {
    tets += piece->tets.size();
    mass += piece->rest.mass();
    driven += static_cast<std::size_t>(std::ranges::count(piece->fixed, 1));
    EXPECT_EQ(piece->collision, contact::make_collision_mesh(piece->tets, piece->X, [&] {
      std::vector<double> masses;
      for (int t = 0; t < piece->rest.tet_count(); ++t) masses.push_back(piece->rest.tet_mass(t));
      return masses;
    }()));
  }
  EXPECT_EQ(tets, whole.tets.size());
  EXPECT_EQ(driven, static_cast<std::size_t>(std::ranges::count(whole.fixed, 1)));
  EXPECT_GT(driven, 0u);
  EXPECT_NEAR(mass, whole.rest.mass(), 1e-9);
  const auto flowed = [](const Mat3& strain) { return !strain.isZero(); };
  EXPECT_EQ(std::ranges::any_of(whole.state.plastic_strain, flowed), kind != Kind::hexahedra);
  const std::vector<double> stress = whole.von_mises();
  std::vector<std::vector<double>> stress_of;
  for (const SoftBody* piece : pieces) stress_of.push_back(piece->von_mises());
  for (std::size_t t = 0; t < stress.size(); ++t) {
    const TetRef to = moved.tet[t];
    EXPECT_NEAR(stress_of[to.piece + 1][to.tet], stress[t], 1e-6 * model.material.young) << t;
  }

  for (int k = 0; k < 6; ++k, time += kDt) {
    step(whole, time, pool);
    for (SoftBody* piece : pieces) step(*piece, time, pool);
    for (int n = 0; n < whole.node_count(); ++n) {
      const NodeRef to = moved.node[n];
      const SoftBody& piece = *pieces[to.piece + 1];
      ASSERT_LT((piece.state.x[to.node] - whole.state.x[n]).norm(), 1e-9) << "node " << n << " step " << k;
      ASSERT_LT((piece.state.v[to.node] - whole.state.v[n]).norm(), 1e-7) << "node " << n << " step " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Pieces, Parting,
                         testing::Combine(testing::Values(Kind::plain, Kind::two_materials, Kind::octahedra,
                                                          Kind::nearly_incompressible_octahedra, Kind::hexahedra),
                                          testing::Values(Integrator::backward_euler, Integrator::bdf2)));

bool is_float(const fem::StepSystem& system) { return std::holds_alternative<linear_solver::BlockSparseMatrix<float>>(system.A); }

// Of a large piece the matrix is in float where it would be if it were a body.
TEST(Pieces, ChooseTheirPrecisionThemselves) {
  // Two blocks, in one body from the start; a corner that breaks lets them part.
  const BodyDescription description = soft_block("blocks", {8, 8, 8}, 0.1, Pose{}, Vec3::Zero(), 1e5);
  FemModel model = std::get<FemModel>(description.model);
  TetMesh blocks = *model.mesh;
  const int nodes = blocks.node_count();
  for (int n = 0; n < nodes; ++n) blocks.X.push_back(blocks.X[n] + Vec3(2, 0, 0));
  for (int t = 0, count = blocks.tet_count(); t < count; ++t) {
    Tet tet = blocks.tets[t];
    for (int& n : tet) n += nodes;
    blocks.tets.push_back(tet);
  }
  model.mesh = std::make_shared<TetMesh>(blocks);
  model.material.breakable = true;
  model.material.toughness = 1e3;
  model.material.cg_tolerance = 1e-3;  // finer ones keep to double
  auto body = SoftBody::make(0, description, model, {.dt = kDt}, "bodies[0].fem");
  ASSERT_TRUE(body) << body.error().text();
  const ThreadPool pool(1);
  ASSERT_TRUE(is_float(body->system));
  for (int n = 0; n < nodes; ++n) body->state.v[n].x() = body->X[n].sum() < 0.25 ? -3 : 0;
  SoftBody::HandOver moved;
  double time = 0;
  const auto is_large = [](const SoftBody& mesh) { return mesh.node_count() >= 500; };
  for (int k = 0; k < 40 && std::ranges::none_of(moved.meshes, is_large); ++k, time += kDt) {
    body->prescribe(time, kDt);
    body->assemble(Vec3::Zero(), kDt, pool);
    ASSERT_TRUE(body->advance(body->system.guess, kDt));  // apart, whatever holds them together
    body->fracture(7, k, pool);
    moved = body->hand_over(pool);
  }
  const auto large = std::ranges::find_if(moved.meshes, is_large);
  ASSERT_NE(large, moved.meshes.end());
  EXPECT_TRUE(is_float(large->system));
}

// ---- in worlds ---------------------------------------------------------------------------------------------------

// A bar on the ground, or in empty space, that is torn in two by its own motion.
BodyDescription torn_bar(double y) {
  BodyDescription bar = soft_block("bar", {12, 2, 2}, 0.1, at(0, y, 0), Vec3::Zero(), 1e7);
  auto& model = std::get<FemModel>(bar.model);
  model.material.breakable = true;
  model.material.toughness = 1e5;
  return bar;
}

std::vector<int> nodes_at_end(double from, double to) {
  const TetMesh mesh = test::kuhn_lattice({12, 2, 2}, 0.1);
  std::vector<int> nodes;
  for (int n = 0; n < mesh.node_count(); ++n)
    if (mesh.X[n].x() > from && mesh.X[n].x() < to) nodes.push_back(n);
  return nodes;
}

void tear(World& world, double impulse) {
  ASSERT_TRUE(world.submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(-1, 0.45), .impulse = Vec3(-impulse, 0, 0)}));
  ASSERT_TRUE(world.submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(0.75, 9), .impulse = Vec3(impulse, 0, 0)}));
}

std::set<std::tuple<double, double, double>> places_of(const FemView& view) {
  std::set<std::tuple<double, double, double>> places;
  for (const Vec3& x : view.x) places.insert({x.x(), x.y(), x.z()});
  return places;
}

// Momenta, and who is commanded: numbers of the scene's mesh name what they named.
TEST(Pieces, KeepMomentaAndTheirNodesNumbers) {
  auto world = make_world(empty_space({torn_bar(0)}));
  tear(*world, 100);
  for (int k = 0; k < 30; ++k) {
    const Energies last = world->energies();
    const int pieces = world->fem(0).fragments;
    world->step();
    const Energies now = world->energies();
    EXPECT_LT(now.momentum.norm(), 1e-7) << k;
    // What a linearised step changes of it is not the parting's.
    if (world->fem(0).fragments == pieces && k > 2) EXPECT_LT((now.angular_momentum - last.angular_momentum).norm(), 1e-5) << k;
    EXPECT_NEAR(world->pose(0).p_WB.x(), 0.6, 1e-9);
  }
  ASSERT_GT(world->fem(0).fragments, 1);
  const FemView before = world->fem(0);
  const Frame drawn = world->capture(true);
  ASSERT_EQ(drawn.bodies[0].positions.size(), world->topology().bodies[0].vertices.size());
  ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(0.75, 9), .impulse = Vec3(0, 50, 0)}));
  ASSERT_TRUE(world->submit(ApplyImpulse{.body = 0, .impulse = Vec3(0, -50, 0), .point = Vec3(-1, 0.1, 0.1), .radius = 1.5}));
  for (int k = 0; k < 10; ++k) world->step();
  const FemView after = world->fem(0);
  ASSERT_EQ(after.x.size(), before.x.size());
  double left = 0, right = 0, left_count = 0, right_count = 0;
  for (std::size_t n = 0; n < after.x.size(); ++n) {
    const double rise = after.x[n].y() - before.x[n].y();
    if (before.x[n].x() < 0.2) left += rise, ++left_count;
    if (before.x[n].x() > 1.0) right += rise, ++right_count;
  }
  EXPECT_LT(left / left_count, -0.05);
  EXPECT_GT(right / right_count, 0.05);
  EXPECT_LT(world->energies().momentum.norm(), 1e-6);
}

// The paper's islands dissolve when they break: one half moves, the other rests.
TEST(Pieces, SleepAndWakeByThemselves) {
  SceneDescription scene;
  scene.dt = kDt;
  scene.bodies = {torn_bar(0), ground()};
  auto world = make_world(scene);
  tear(*world, 150);
  while (world->time() < 30 && world->workload().live_bodies > 0) world->step();
  const Workload rest = world->workload();
  ASSERT_EQ(rest.live_bodies, 0);
  ASSERT_GT(world->fem(0).fragments, 1);
  const FemView lying = world->fem(0);

  ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(0.75, 9), .impulse = Vec3(60, 0, 0)}));
  const Workload load = world->step().workload;
  EXPECT_EQ(load.live_bodies, 1);
  EXPECT_EQ(load.asleep_bodies, 0);
  EXPECT_FALSE(world->is_asleep(0));
  EXPECT_GT(load.live_tets, 50);
  EXPECT_GT(load.asleep_tets, 50);
  for (int k = 0; k < 5; ++k) world->step();
  const auto places = places_of(world->fem(0));  // which may have broken again
  int stayed = 0, went = 0;
  for (const Vec3& x : lying.x) {
    if (x.x() < 0.3) stayed += places.contains({x.x(), x.y(), x.z()});
    if (x.x() > 1.0) went += !places.contains({x.x(), x.y(), x.z()});
  }
  EXPECT_EQ(stayed, std::ranges::count_if(lying.x, [](const Vec3& x) { return x.x() < 0.3; }));
  EXPECT_GT(stayed, 10);
  EXPECT_GT(went, 10);
  while (world->time() < 60 && world->workload().live_bodies > 0) world->step();
  EXPECT_EQ(world->workload().live_bodies, 0);
  EXPECT_TRUE(world->is_asleep(0));
}

// What is still held stays, and rests while the other half flies.
TEST(Pieces, ThatAreHeldRestWhileOthersFly) {
  const FemModel model = std::get<FemModel>(torn_bar(0).model);
  BodyDescription bar = torn_bar(0);
  auto& held = std::get<FemModel>(bar.model);
  held.motions.push_back({.nodes = nodes_at_end(-1, 0.65)});
  auto world = make_world(empty_space({bar}));
  ASSERT_EQ(world->workload().live_tets, 288);
  ASSERT_TRUE(world->submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(0.65, 9), .impulse = Vec3(1000, 0, 0)}));
  for (int k = 0; k < 120; ++k) world->step();
  const FemView view = world->fem(0);
  ASSERT_GT(view.fragments, 1);
  for (const int n : nodes_at_end(-1, 0.55)) {
    const auto near = [&](const Vec3& x) { return (x - model.mesh->X[n]).norm() < 1e-12; };
    EXPECT_TRUE(std::ranges::any_of(view.x, near)) << n;
  }
  int moving = 0;
  for (const Tet& tet : view.tets) moving += std::ranges::any_of(tet, [&](int n) { return !view.v[n].isZero(0); });
  EXPECT_GT(moving, 50);
  EXPECT_LT(moving, 200);
  EXPECT_EQ(view.rigid_fragments, 0);
  EXPECT_EQ(world->workload().live_tets, moving);
}

TEST(Pieces, SameBitsWithTwoThreads) {
  SceneDescription scene;
  scene.dt = kDt;
  scene.bodies = {torn_bar(0.05), torn_bar(0.4), ground()};
  scene.bodies[1].name = "other";
  scene.bodies[1].pose = {Quat(Eigen::AngleAxisd(0.7, Vec3::UnitY())), Vec3(0.2, 0.4, 0.4)};
  auto one = make_world(scene, 1), two = make_world(scene, 2);
  tear(*one, 150);
  tear(*two, 150);
  for (int k = 0; k < 90; ++k) {
    one->step();
    two->step();
    ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
  }
  EXPECT_GT(one->fem(0).fragments, 1);
}

// Whatever happens to one, and however carefully the guard steps it: the others do as they would have done.
TEST(Pieces, DoNotDisturbEachOther) {
  auto quiet = make_world(empty_space({torn_bar(0)})), loud = make_world(empty_space({torn_bar(0)}));
  for (World* world : {quiet.get(), loud.get()}) {
    tear(*world, 150);
    for (int k = 0; k < 300; ++k) world->step();  // far apart
    (void)world->take_events();
  }
  const FemView before = quiet->fem(0);
  ASSERT_GT(before.fragments, 1);
  int climbed = 0;
  for (int k = 0; k < 40; ++k) {
    // Turned inside out at one end, again and again.
    ASSERT_TRUE(loud->submit(ApplyNodeImpulse{.body = 0, .nodes = nodes_at_end(1.15, 9), .impulse = Vec3(0, k % 2 ? 400 : -400, 0)}));
    loud->step();
    quiet->step();
    for (const Event& event : loud->take_events()) climbed += event.kind == EventKind::guard;
  }
  EXPECT_GT(climbed, 0);
  const FemView undisturbed = quiet->fem(0);
  const auto found = places_of(loud->fem(0));
  int left = 0;
  for (std::size_t n = 0; n < before.x.size(); ++n) {
    if (before.x[n].x() > 0.2) continue;
    const Vec3& p = undisturbed.x[n];
    EXPECT_TRUE(found.contains({p.x(), p.y(), p.z()})) << n;
    ++left;
  }
  EXPECT_GT(left, 10);
}

}  // namespace
}  // namespace crumple::sim
