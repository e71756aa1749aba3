// The shipped scenes with game meshes of others in the place of generated bodies: open, in many parts,
// self-intersecting.
#include "tests/integration/scene_run.h"

namespace crumple::test {
namespace {

constexpr double kGround = 0.1;  // [m], as for the shipped scenes

v1::ExampleBody& with_rig(v1::Body& body, const std::string& file, double scale) {
  *body.mutable_example()->mutable_asset() = parse<v1::AssetSource>(
      "default_rig { surface { file: '" + file + "' scale: " + std::to_string(scale) + " } tet_budget: 3000 }");
  return *body.mutable_example();
}

// Height 0.76 m, origin at the foot: the place of a generated barrel of that height, whose origin is its middle.
void make_real_barrel(v1::Body& body, bool large) {
  with_rig(body, large ? "kaykit_barrel_large.glb" : "kaykit_barrel_small.glb", large ? 0.38 : 0.7468);
  v1::Vec3* at = body.mutable_pose()->mutable_position();
  at->set_y(at->y() - 0.38);
}

TEST(RealMeshes, BarrelsAreDentedByTheDock) {
  CRUMPLE_NEED_SHARED("meshes");
  v1::Scene scene = shipped_scene("barrels");
  const std::vector<std::string> barrels{"barrel 1", "barrel 2", "barrel 3"};
  for (std::size_t k = 0; k < barrels.size(); ++k) make_real_barrel(body_of(scene, barrels[k]), k != 1);
  SceneRun run(scene, shared_data("meshes"));
  ASSERT_TRUE(run.started());
  run.step(400, kGround);
  for (const std::string& barrel : barrels) {
    EXPECT_GT(run.events_of(sim::EventKind::dent, barrel), 0) << barrel;
    EXPECT_GT(run.dent(barrel), 0.1) << barrel;
    EXPECT_TRUE(run.weights_are_a_simplex(barrel)) << barrel;
  }
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(RealMeshes, ASedanDentsBarrelsAndItselfAndBreaksTheGlass) {
  CRUMPLE_NEED_SHARED("meshes");
  v1::Scene scene = shipped_scene("crash");
  v1::Body& car = body_of(scene, "car");
  with_rig(car, "kaykit_car_sedan.obj", 4.5);
  // It looks along z, and its wheels reach 0.03 below its origin.
  *car.mutable_pose() = parse<v1::Pose>("position { x: -8 y: 0.145 } rotation_vector { y: 1.5707963267948966 }");
  for (int k = 1; k <= 9; ++k) make_real_barrel(body_of(scene, "barrel " + std::to_string(k)), true);
  SceneRun run(scene, shared_data("meshes"));
  ASSERT_TRUE(run.started());
  run.step(220, kGround);
  int dented = 0;
  for (int k = 1; k <= 9; ++k) {
    const std::string barrel = "barrel " + std::to_string(k);
    EXPECT_TRUE(run.weights_are_a_simplex(barrel)) << barrel;
    dented += run.dent(barrel) > 0.1;
  }
  EXPECT_GE(dented, 6);
  EXPECT_GT(run.dent("car"), 0.1);
  EXPECT_TRUE(run.weights_are_a_simplex("car"));
  EXPECT_GT(run.events_of(sim::EventKind::fracture, "glass middle"), 0);
  EXPECT_EQ(run.frozen_bodies(), 0);
}

TEST(RealMeshes, ACrackedWallBreaksUnderTheBall) {
  CRUMPLE_NEED_SHARED("meshes");
  v1::Scene scene = shipped_scene("pane");
  v1::Body& wall = body_of(scene, "pane");  // 2 x 2 x 0.63 m from its foot
  *wall.mutable_pose() = parse<v1::Pose>("position { y: 0.2 }");
  *wall.mutable_fem()->mutable_mesh() =
      parse<v1::TetSource>("enclosing { surface { file: 'kaykit_wall_cracked.glb' scale: 0.5 } tet_budget: 2000 }");
  wall.mutable_fem()->mutable_material()->set_toughness(5e4);  // brick
  SceneRun run(scene, shared_data("meshes"));
  ASSERT_TRUE(run.started());
  const int pieces = run.fragments("pane");
  run.step(120, kGround);
  EXPECT_GT(run.events_of(sim::EventKind::fracture, "pane"), 0);
  EXPECT_GT(run.fragments("pane"), pieces);
  EXPECT_EQ(run.frozen_bodies(), 0);
}

// A cow of rubber lands on its hoofs and lies or stands still, in its own shape.
TEST(RealMeshes, ASoftCowComesToRestInItsShape) {
  CRUMPLE_NEED_SHARED("meshes");
  v1::Scene scene = shipped_scene("barrels");
  keep_bodies(scene, {"ground"});
  *scene.add_bodies() = parse<v1::Body>(R"(
      name: "cow" pose { position { y: 1 } }
      fem { mesh { enclosing { surface { file: "od_spot_low.obj" scale: 0.6 } tet_budget: 2500 } }
            material { young: 3e5 poisson_ratio: 0.4 density: 500 damping_mass: 2 damping_stiffness: 0.004 }
            render { file: "od_spot_low.obj" scale: 0.6 } })");
  SceneRun run(scene, shared_data("meshes"));
  ASSERT_TRUE(run.started());
  const std::vector<Vec3> before = run.world().fem(1).x;
  run.step(480, kGround);
  const auto view = run.world().fem(1);
  EXPECT_LT(run.world().pose(1).p_WB.y(), 0.6);  // it fell by half a metre or more
  EXPECT_LT(run.world().velocity(1).norm(), 0.1);
  EXPECT_EQ(view.inverted, 0);
  EXPECT_EQ(run.frozen_bodies(), 0);
  // Its tets' volume, under its own weight: rho g h / E is 1.5 %.
  const auto volume = [&](const std::vector<Vec3>& x) {
    double sum = 0;
    for (const auto& [a, b, c, d] : view.tets) sum += (x[b] - x[a]).cross(x[c] - x[a]).dot(x[d] - x[a]) / 6;
    return sum;
  };
  EXPECT_NEAR(volume(view.x) / volume(before), 1, 0.03);
}

// A trestle bridge of 20 m, held at its feet: its middle gives way by 0.1 mm under a load of four tonnes, by twice
// that under eight, and not at all far from the load.
TEST(RealMeshes, ABridgeGivesWayInProportionToItsLoad) {
  CRUMPLE_NEED_SHARED("meshes");
  struct Sag {
    double middle = 0, ends = 0;  // mean, downwards [m]
  };
  const auto sag = [](double load) {
    v1::Scene scene = parse<v1::Scene>(R"(
        name: "bridge" gravity { y: 0 } dt: 0.01
        bodies { name: "bridge"
                 fem { mesh { enclosing { surface { file: "vega_simpleBridge.obj" } tet_budget: 5000 } }
                       material { young: 1e8 density: 500 damping_mass: 40 damping_stiffness: 0.01
                                  cg_tolerance: 1e-6 cg_max_iterations: 4000 }
                       motions { nodes { face: "y_min" tolerance: 0.1 } } } }
        script { command { apply_force { body: "bridge" point { y: 1 } radius: 2 duration: 100 } } })");
    scene.mutable_script(0)->mutable_command()->mutable_apply_force()->mutable_force()->set_y(-load);
    SceneRun run(scene, shared_data("meshes"));
    EXPECT_TRUE(run.started());
    if (!run.started()) return Sag();
    const std::vector<Vec3> before = run.world().fem(0).x;
    run.step(60, 1);  // the lattice reaches below the feet
    const auto view = run.world().fem(0);
    EXPECT_EQ(run.frozen_bodies() + view.inverted, 0);
    EXPECT_EQ(view.fragments, 1);
    EXPECT_LT(run.world().velocity(0).norm(), 1e-4);
    const auto mean = [&](auto chosen) {
      double sum = 0, count = 0;
      for (std::size_t n = 0; n < before.size(); ++n)
        if (chosen(std::abs(before[n].x()))) sum += before[n].y() - view.x[n].y(), ++count;
      return sum / count;
    };
    return Sag{mean([](double x) { return x < 2; }), mean([](double x) { return x > 8; })};
  };
  const Sag once = sag(4e4), twice = sag(8e4);
  EXPECT_GT(once.middle, 5e-5);
  EXPECT_LT(std::abs(once.ends), 0.01 * once.middle);
  // Strains are small, but the lattice's corners with little in them turn far: a per cent or so.
  EXPECT_NEAR(twice.middle / once.middle, 2, 0.02);
}

}  // namespace
}  // namespace crumple::test
