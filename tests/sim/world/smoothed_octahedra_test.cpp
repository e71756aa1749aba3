// Bodies of smoothed octahedra in whole worlds: with contact, flow, fracture and rigid fragments, as those of plain tets.
#include "server/authoring/shapes/box_lattice.h"
#include "server/sim/fem/elements.h"
#include "tests/sim/world/world_bodies.h"

namespace crumple::sim {
namespace {

constexpr double kPoissons[] = {0.3, 0.49};  // the latter with pressure patches

BodyDescription bcc_block(const std::string& name, const Vec3& size, std::array<int, 3> cells, const Pose& pose, double young) {
  FemModel model;
  model.mesh = std::make_shared<TetMesh>(*authoring::centred_box_mesh(size, cells, authoring::Lattice::bcc));
  model.element = fem::ElementKind::smoothed_octahedra;
  model.material.young = young;
  return {.name = name, .pose = pose, .model = model};
}

// A pane that breaks under a ball, over ground.
SceneDescription broken_pane(bool bdf2 = false, double poisson = 0.3) {
  BodyDescription pane = bcc_block("pane", {0.8, 0.1, 0.8}, {8, 1, 8}, at(0, 0.35, 0), 1e7);
  auto& model = std::get<FemModel>(pane.model);
  model.material.poisson = poisson;
  model.material.breakable = true;
  model.material.toughness = 2e4;
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.integrator = bdf2 ? Integrator::bdf2 : Integrator::backward_euler;
  scene.bodies = {pane, ball("ball", 0.1, 20, at(0.02, 0.9, -0.03), Vec3(0, -15, 0)), ground()};
  return scene;
}

TEST(SmoothedOctahedra, ABrokenPaneComesToRestInPieces) {
  for (const auto& [bdf2, poisson] : {std::pair{false, 0.3}, {true, 0.3}, {false, 0.49}, {true, 0.49}}) {
    auto world = make_world(broken_pane(bdf2, poisson));
    const Energies start = world->energies();
    for (int k = 0; k < 60 * 2; ++k) {
      world->step();
      EXPECT_LT(world->energies().kinetic, 1.05 * (start.kinetic + start.gravitational)) << k;
    }
    const FemView view = world->fem(0);
    EXPECT_GT(view.fragments, 5);
    EXPECT_GT(view.rigid_fragments, 0);
    EXPECT_EQ(view.inverted, 0);
    EXPECT_EQ(view.von_mises.size(), view.tets.size());
    EXPECT_EQ(view.plastic_strain.size(), view.tets.size());
    for (const Vec3& x : view.x) EXPECT_GT(x.y(), -0.05);
    for (const Vec3& v : view.v) EXPECT_LT(v.norm(), 0.5);
    EXPECT_LT(world->energies().elastic, 1);
  }
}

// Where tets begin to stand for themselves energy jumps; a beam that sags by eight tenths of its length stays short of that.
TEST(SmoothedOctahedra, ABeamThatSwingsWideGainsNoEnergy) {
  FemModel model;
  model.mesh = std::make_shared<TetMesh>(*authoring::beam({1, 0.1, 0.1}, {10, 2, 2}, authoring::Lattice::kuhn));
  model.element = fem::ElementKind::smoothed_octahedra;
  NodeMotion held;
  for (int n = 0; n < model.mesh->node_count(); ++n)
    if (model.mesh->X[n].x() == 0) held.nodes.push_back(n);
  model.motions = {held};
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.integrator = Integrator::bdf2;
  scene.bodies = {{.name = "beam", .model = model}};
  auto world = make_world(scene);
  const auto total = [&] {
    const Energies e = world->energies();
    return e.kinetic + e.elastic + e.gravitational;
  };
  const double start = total();
  double lowest = 0;
  for (int k = 0; k < 600; ++k) {
    world->step();
    EXPECT_LT(total() - start, 0.1) << k;  // of 36 J that swing: the solves' 1e-3
    for (const Vec3& x : world->fem(0).x) lowest = std::min(lowest, x.y());
  }
  EXPECT_LT(lowest, -0.75);
}

TEST(SmoothedOctahedra, SameBitsWithTwoThreadsWhileItBreaks) {
  for (const auto& [bdf2, poisson] : {std::pair{false, 0.3}, {true, 0.3}, {false, 0.49}}) {
    auto one = make_world(broken_pane(bdf2, poisson), 1), two = make_world(broken_pane(bdf2, poisson), 2);
    for (int k = 0; k < 12; ++k) {
      one->step();
      two->step();
      ASSERT_EQ(one->state_hash(), two->state_hash()) << k;
    }
    EXPECT_GT(one->fem(0).fragments, 3);
  }
}

// In space nothing is lost by breaking: momentum and angular momentum stay what they were.
TEST(SmoothedOctahedra, BreakingKeepsMomentum) {
  for (const double poisson : kPoissons) {
    SceneDescription scene = broken_pane(false, poisson);
    scene.gravity = Vec3::Zero();
    scene.bodies.pop_back();
    std::get<FemModel>(scene.bodies[0].model).material.cg_tolerance = 1e-11;
    std::get<FemModel>(scene.bodies[0].model).material.cg_max_iterations = 3000;
    auto world = make_world(scene);
    const Energies start = world->energies();
    for (int k = 0; k < 30; ++k) world->step();
    EXPECT_GT(world->fem(0).fragments, 1) << poisson;
    EXPECT_LT((world->energies().momentum - start.momentum).norm(), 1e-6 * start.momentum.norm()) << poisson;
  }
}

// A plate of ductile metal is dented and stays so; on a finer mesh it is about the same.
TEST(SmoothedOctahedra, MetalKeepsItsDent) {
  const auto dent = [&](fem::ElementKind element, std::array<int, 3> cells) {
    BodyDescription plate = bcc_block("plate", {1, 0.06, 1}, cells, at(0, 0, 0), 1e8);
    auto& model = std::get<FemModel>(plate.model);
    model.element = element;
    model.material.yield = 0.002;
    model.material.creep = 0.8;
    model.material.flow = fem::FlowRule::deviatoric;
    NodeMotion held;
    for (int n = 0; n < model.mesh->node_count(); ++n) {
      if (std::max(std::abs(model.mesh->X[n].x()), std::abs(model.mesh->X[n].z())) > 0.499) held.nodes.push_back(n);
    }
    model.motions = {held};
    SceneDescription scene;
    scene.gravity = Vec3::Zero();
    scene.dt = 1.0 / 120;
    scene.bodies = {plate, ball("ball", 0.15, 100, at(0, 0.2, 0), Vec3(0, -6, 0))};
    auto world = make_world(scene);
    for (int k = 0; k < 240; ++k) world->step();
    double lowest = 0, flowed = 0;
    for (const Vec3& x : world->fem(0).x) lowest = std::min(lowest, x.y() + 0.03);
    for (const Mat3& p : world->fem(0).plastic_strain) {
      flowed = std::max(flowed, p.norm());
      EXPECT_LT(std::abs(p.trace()), 1e-12);
    }
    EXPECT_GT(flowed, 0.005);
    return -lowest;
  };
  const double coarse = dent(fem::ElementKind::smoothed_octahedra, {8, 1, 8});
  const double fine = dent(fem::ElementKind::smoothed_octahedra, {16, 2, 16});
  EXPECT_GT(coarse, 0.005);
  EXPECT_NEAR(coarse, fine, 0.5 * fine);  // a coarse plate meets a ball with few nodes
}

// A resting block: does not sink, tremble or creep.
TEST(SmoothedOctahedra, ABlockRestsAndSleeps) {
  for (const double poisson : kPoissons) {
    SceneDescription scene;
    scene.dt = 1.0 / 60;
    scene.bodies = {bcc_block("block", {0.5, 0.5, 0.5}, {3, 3, 3}, at(0, 0.26, 0), 1e6), ground()};
    std::get<FemModel>(scene.bodies[0].model).material.poisson = poisson;
    auto world = make_world(scene);
    for (int k = 0; k < 60 * 10; ++k) world->step();
    EXPECT_EQ(world->workload().live_bodies, 0) << poisson;
    for (const Vec3& x : world->fem(0).x) EXPECT_GT(x.y(), -0.005) << poisson;
  }
}

TEST(SmoothedOctahedra, DrawnStressIsTheMeanOfTheTwoOctahedraOfATet) {
  SceneDescription scene;
  scene.dt = 1.0 / 60;
  scene.integrator = Integrator::bdf2;  // whose own elements are elsewhere: what is drawn is computed anew
  BodyDescription beam = bcc_block("beam", {1, 0.2, 0.2}, {10, 2, 2}, at(0, 0, 0), 1e6);
  auto& model = std::get<FemModel>(beam.model);
  NodeMotion held;
  for (int n = 0; n < model.mesh->node_count(); ++n)
    if (model.mesh->X[n].x() < -0.499) held.nodes.push_back(n);
  model.motions = {held};
  scene.bodies = {beam};
  auto world = make_world(scene);
  for (int k = 0; k < 20; ++k) world->step();
  const FemView view = world->fem(0);
  const auto rest = fem::make_rest_body(*model.mesh, model.material, 0, {}, model.element);
  fem::Elements elements;
  const std::vector<Mat3> none(rest->point_count(), Mat3::Zero());
  fem::update_elements(*rest, view.tets, view.x, none, ThreadPool(1), elements);
  double largest = 0;
  for (int t = 0; t < rest->tet_count(); ++t) {
    Mat3 stress = Mat3::Zero();
    for (int k = 0; k < 2; ++k) {
      const int d = rest->macros.of_tet[2 * t + k];
      const Mat3& Q = elements.macros.Q[d];
      stress += 0.5 * Q * elements.macros.sigma[d] * Q.transpose();
    }
    EXPECT_NEAR(view.von_mises[t], fem::von_mises(stress), 1e-9 * fem::von_mises(stress)) << t;
    largest = std::max(largest, view.von_mises[t]);
  }
  EXPECT_GT(largest, 1e4);
}

}  // namespace
}  // namespace crumple::sim
