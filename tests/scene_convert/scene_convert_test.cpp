#include "server/scene_convert/scene_convert.h"

#include "tests/scene_convert/parse_scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <numbers>

namespace crumple::scene_convert {
namespace {

using test::parse;

sim::SceneDescription convert(const std::string& text) {
  auto scene = to_scene(parse<v1::Scene>(text), NoFiles());
  EXPECT_TRUE(scene) << scene.error().text();
  return scene ? *std::move(scene) : sim::SceneDescription();
}

constexpr const char* kTet = "inline_mesh { positions: [0,0,0, 1,0,0, 0,1,0, 0,0,1] tets: [0,1,2,3] }";

std::string fem_body(const std::string& rest) {
  return std::string("bodies { name: 'b' fem { mesh { ") + kTet + " } " + rest + " } }";
}

constexpr const char* kInlineAsset =
    "inline_asset { mesh { positions: [0,0,0, 1,0,0, 0,1,0, 0,0,1] tets: [0,1,2,3] }"
    " weights { bones: 1 dense { values: [1,1,1,1] } } examples { name: 'rest' bones {} }"
    " convex_parts { vertices: [0,1,2,3] } }";

TEST(SceneConvert, MissingFieldsTakeTheDefaultsOfTheScene) {
  const sim::SceneDescription got = convert(""), expected;
  EXPECT_EQ(got.gravity, expected.gravity);
  EXPECT_EQ(got.dt, expected.dt);
  EXPECT_EQ(got.rigid_substeps, expected.rigid_substeps);
  EXPECT_EQ(got.rigid_iterations, expected.rigid_iterations);
  EXPECT_EQ(got.creep_dt, expected.creep_dt);
  EXPECT_EQ(got.rate_dt, expected.rate_dt);
  EXPECT_EQ(got.integrator, expected.integrator);
  EXPECT_EQ(got.float_solver, expected.float_solver);
  EXPECT_EQ(got.unguarded, expected.unguarded);
  EXPECT_EQ(got.solver, expected.solver);
  EXPECT_EQ(got.seed, expected.seed);
  EXPECT_EQ(got.contact.raw_damping, expected.contact.raw_damping);
  EXPECT_EQ(got.contact.phi, expected.contact.phi);
  EXPECT_EQ(got.contact.kappa, expected.contact.kappa);
  EXPECT_EQ(got.contact.recovery_steps, expected.contact.recovery_steps);
  EXPECT_EQ(got.contact.max_recovery_speed, expected.contact.max_recovery_speed);
  EXPECT_EQ(got.contact.friction, expected.contact.friction);
  EXPECT_EQ(got.sleep.speed, expected.sleep.speed);
  EXPECT_EQ(got.sleep.time, expected.sleep.time);
  EXPECT_EQ(got.sleep.wake_acceleration, expected.sleep.wake_acceleration);
}

TEST(SceneConvert, MissingFieldsOfARigidBodyTakeItsDefaults) {
  const auto scene = convert(
      "bodies { name: 'a' rigid { shapes { box {} } } } bodies { name: 'b' rigid { shapes { sphere {} } } }"
      "bodies { name: 'c' rigid { shapes { cylinder {} } } }"
      "bodies { name: 'd' rigid { kind: FIXED shapes { plane {} } } }");
  ASSERT_EQ(scene.bodies.size(), 4u);
  const auto& got = std::get<sim::RigidModel>(scene.bodies[0].model);
  const sim::RigidModel expected;
  EXPECT_EQ(got.kind, expected.kind);
  EXPECT_EQ(got.density, expected.density);
  EXPECT_EQ(got.mass, expected.mass);
  EXPECT_EQ(got.friction, expected.friction);
  EXPECT_EQ(got.restitution, expected.restitution);
  EXPECT_EQ(scene.bodies[0].colour, sim::BodyDescription().colour);
  EXPECT_EQ(scene.bodies[0].opacity, sim::BodyDescription().opacity);
  const auto shape = [&](int i) { return std::get<sim::RigidModel>(scene.bodies[i].model).shapes.at(0).shape; };
  EXPECT_EQ(std::get<sim::Box>(shape(0)).half_extents, sim::Box().half_extents);
  EXPECT_EQ(std::get<sim::Sphere>(shape(1)).radius, sim::Sphere().radius);
  EXPECT_EQ(std::get<sim::Cylinder>(shape(2)).radius, sim::Cylinder().radius);
  EXPECT_EQ(std::get<sim::Cylinder>(shape(2)).half_length, sim::Cylinder().half_length);
  EXPECT_EQ(std::get<sim::Plane>(shape(3)).normal, sim::Plane().normal);
  EXPECT_EQ(std::get<sim::Plane>(shape(3)).offset, sim::Plane().offset);
}

TEST(SceneConvert, MissingFieldsOfAMaterialTakeItsDefaults) {
  const auto scene = convert(fem_body(""));
  const auto& model = std::get<sim::FemModel>(scene.bodies.at(0).model);
  const sim::fem::FemMaterial& got = model.material;
  const sim::fem::FemMaterial expected;
  EXPECT_EQ(got.young, expected.young);
  EXPECT_EQ(got.poisson, expected.poisson);
  EXPECT_EQ(got.density, expected.density);
  EXPECT_EQ(got.damping_mass, expected.damping_mass);
  EXPECT_EQ(got.damping_stiffness, expected.damping_stiffness);
  EXPECT_EQ(got.rotation, expected.rotation);
  EXPECT_EQ(got.flow, expected.flow);
  EXPECT_EQ(got.yield, expected.yield);
  EXPECT_EQ(got.creep, expected.creep);
  EXPECT_EQ(got.max_plastic, expected.max_plastic);
  EXPECT_EQ(got.raw_creep, expected.raw_creep);
  EXPECT_EQ(got.breakable, expected.breakable);
  EXPECT_EQ(got.toughness, expected.toughness);
  EXPECT_EQ(got.raw_toughness, expected.raw_toughness);
  EXPECT_EQ(got.fracture_interval, expected.fracture_interval);
  EXPECT_EQ(got.max_splits_per_step, expected.max_splits_per_step);
  EXPECT_EQ(got.fracture_order, expected.fracture_order);
  EXPECT_EQ(got.dust, expected.dust);
  EXPECT_EQ(got.friction, expected.friction);
  EXPECT_EQ(got.cg_tolerance, expected.cg_tolerance);
  EXPECT_EQ(got.cg_max_iterations, expected.cg_max_iterations);
  EXPECT_EQ(model.clamp_limit, sim::FemModel().clamp_limit);
  EXPECT_EQ(model.rigid_fragments, sim::FemModel().rigid_fragments);
  EXPECT_EQ(model.self_contact, sim::FemModel().self_contact);
  EXPECT_TRUE(model.regions.empty());
  EXPECT_EQ(model.splinters, nullptr);
}

TEST(SceneConvert, MissingFieldsOfAnExampleBodyTakeItsDefaults) {
  const auto scene = convert(std::string("bodies { name: 'b' example { asset { ") + kInlineAsset + " } } }");
  const auto& model = std::get<sim::ExampleModel>(scene.bodies.at(0).model);
  const auto& got = model.parameters;
  const sim::example_based::ExampleParameters expected;
  EXPECT_EQ(got.alpha, expected.alpha);
  EXPECT_EQ(got.beta, expected.beta);
  EXPECT_EQ(got.gamma, expected.gamma);
  EXPECT_EQ(got.lambda, expected.lambda);
  EXPECT_EQ(got.mu, expected.mu);
  EXPECT_EQ(got.nu, expected.nu);
  EXPECT_EQ(got.restitution, expected.restitution);
  EXPECT_EQ(got.raw_rates, expected.raw_rates);
  EXPECT_EQ(got.step, expected.step);
  EXPECT_EQ(got.triangle_collision, expected.triangle_collision);
  EXPECT_EQ(got.tet_collision, expected.tet_collision);
  EXPECT_EQ(got.secondary_goal, expected.secondary_goal);
  EXPECT_EQ(got.goal_tolerance, expected.goal_tolerance);
  EXPECT_EQ(got.keep_volume, expected.keep_volume);
  EXPECT_EQ(got.fatigue_time, expected.fatigue_time);
  EXPECT_EQ(model.density, sim::ExampleModel().density);
  EXPECT_EQ(model.mass, sim::ExampleModel().mass);
  EXPECT_EQ(model.friction, sim::ExampleModel().friction);
}

// Every scalar at a value that is not its default.
TEST(SceneConvert, EveryFieldArrives) {
  const auto scene = convert(
      "name: 'n' gravity { z: -1 } dt: 0.004 rigid_substeps: 3 rigid_iterations: 17 creep_dt: 0.02 rate_dt: 0.03 joint_time: 0.04 integrator: BDF2 float_solver: true unguarded: true solver: MULTIGRID seed: 9 "
      "contact { raw_damping: true phi: 5 kappa: 6 recovery_steps: 7 max_recovery_speed: 8 friction: WEIGHT_HEURISTIC } "
      "sleep { speed: 0.5 time: 0.25 wake_acceleration: 3 } "
      "bodies { name: 'r' pose { position { x: 1 y: 2 z: 3 } } velocity { x: 4 } angular_velocity { y: 5 }"
      "  colour { r: 0.5 g: 0.25 b: 1 } opacity: 0.5"
      "  rigid { kind: KINEMATIC density: 7 mass: 8 friction: 0.9 restitution: 0.75 proxy_tets: 100"
      "    shapes { pose { position { y: 1 } } cylinder { radius: 2 half_length: 3 } }"
      "    shapes { convex_hull { points {} points { x: 1 } points { y: 1 } points { z: 1 } } }"
      "    motion { time: 1 pose { position { x: 6 } } } motion { time: 2 } } } " +
      fem_body("clamp_limit: 50 element: SMOOTHED_OCTAHEDRA rigid_fragments: 12 self_contact: true material { young: 2e7 poisson_ratio: 0.25 density: 2500 damping_mass: 1"
               " damping_stiffness: 2 rotation: POLAR_QR flow: DEVIATORIC yield: 0.5 creep: 0.75 max_plastic: 3 raw_creep: true"
               " breakable: true toughness: 1e5 raw_toughness: true fracture_interval: 4 max_splits_per_step: 5 fracture_order: LARGEST_FIRST"
               " dust: 7 friction: 0.6 cg_tolerance: 1e-7 cg_max_iterations: 80 }"
               " motions { nodes { ids { ids: [3, 0] } } keys { time: 1 pose { position { z: 2 } } } }") +
      "bodies { name: 'e' asleep: true example { density: 10 mass: 11 friction: 1.5 parameters { alpha: 1 beta: 2 gamma: 3"
      " lambda: 0.5 mu: 4 nu: 5 restitution: 0.25 raw_rates: true step: EQUATION_10 triangle_collision: true"
      " secondary_goal: SMOOTH_WEIGHTS goal_tolerance: 0.01 keep_volume: true fatigue_time: 6 } asset "
      "{ " +
      kInlineAsset + " } } }");
  EXPECT_EQ(scene.name, "n");
  EXPECT_EQ(scene.gravity, Vec3(0, 0, -1));
  EXPECT_EQ(scene.dt, 0.004);
  EXPECT_EQ(scene.rigid_substeps, 3);
  EXPECT_EQ(scene.rigid_iterations, 17);
  EXPECT_EQ(scene.creep_dt, 0.02);
  EXPECT_EQ(scene.rate_dt, 0.03);
  EXPECT_EQ(scene.joint_time, 0.04);
  EXPECT_EQ(scene.integrator, sim::Integrator::bdf2);
  EXPECT_EQ(scene.float_solver, true);
  EXPECT_TRUE(scene.unguarded);
  EXPECT_EQ(scene.solver, sim::linear_solver::SolverKind::multigrid);
  EXPECT_EQ(scene.seed, 9u);
  EXPECT_TRUE(scene.contact.raw_damping);
  EXPECT_EQ(scene.contact.phi, 5);
  EXPECT_EQ(scene.contact.kappa, 6);
  EXPECT_EQ(scene.contact.recovery_steps, 7);
  EXPECT_EQ(scene.contact.max_recovery_speed, 8);
  EXPECT_EQ(scene.contact.friction, sim::FrictionLaw::weight_heuristic);
  EXPECT_EQ(scene.sleep.speed, 0.5);
  EXPECT_EQ(scene.sleep.time, 0.25);
  EXPECT_EQ(scene.sleep.wake_acceleration, 3);

  const sim::BodyDescription& r = scene.bodies.at(0);
  EXPECT_EQ(r.pose.p_WB, Vec3(1, 2, 3));
  EXPECT_EQ(r.velocity, Vec3(4, 0, 0));
  EXPECT_EQ(r.angular_velocity, Vec3(0, 5, 0));
  EXPECT_EQ(r.colour, (std::array{0.5f, 0.25f, 1.0f}));
  EXPECT_EQ(r.opacity, 0.5f);
  EXPECT_FALSE(r.asleep);
  EXPECT_TRUE(scene.bodies.at(2).asleep);
  const auto& rigid = std::get<sim::RigidModel>(r.model);
  EXPECT_EQ(rigid.kind, sim::RigidKind::kinematic);
  EXPECT_EQ(rigid.density, 7);
  EXPECT_EQ(rigid.mass, 8);
  EXPECT_EQ(rigid.friction, 0.9);
  EXPECT_EQ(rigid.restitution, 0.75);
  EXPECT_EQ(rigid.shapes.at(0).pose.p_WB, Vec3(0, 1, 0));
  EXPECT_EQ(std::get<sim::Cylinder>(rigid.shapes[0].shape).half_length, 3);
  EXPECT_EQ(std::get<sim::ConvexHull>(rigid.shapes.at(1).shape).points.size(), 4u);
  EXPECT_EQ(rigid.motion.at(0).pose.p_WB, Vec3(6, 0, 0));
  EXPECT_EQ(rigid.motion.at(1).time, 2);

  const auto& fem = std::get<sim::FemModel>(scene.bodies.at(1).model);
  const sim::fem::FemMaterial& m = fem.material;
  EXPECT_EQ((std::vector{m.young, m.poisson, m.density, m.damping_mass, m.damping_stiffness, m.yield, m.creep,
                         m.max_plastic, m.toughness, m.friction, m.cg_tolerance, fem.clamp_limit}),
            (std::vector{2e7, 0.25, 2500., 1., 2., 0.5, 0.75, 3., 1e5, 0.6, 1e-7, 50.}));
  EXPECT_EQ(fem.rigid_fragments, 12);
  EXPECT_TRUE(fem.self_contact);
  EXPECT_EQ(fem.element, sim::fem::ElementKind::smoothed_octahedra);
  EXPECT_EQ((std::vector{m.fracture_interval, m.max_splits_per_step, m.cg_max_iterations}), (std::vector{4, 5, 80}));
  EXPECT_EQ(m.dust, 7);
  EXPECT_EQ(m.fracture_order, sim::fem::FractureOrder::largest_first);
  EXPECT_EQ(m.rotation, sim::fem::RotationRule::polar_qr);
  EXPECT_EQ(m.flow, sim::fem::FlowRule::deviatoric);
  EXPECT_TRUE(m.raw_creep && m.breakable && m.raw_toughness);
  EXPECT_EQ(fem.motions.at(0).nodes, (std::vector{0, 3}));
  EXPECT_EQ(fem.motions[0].keys.at(0).pose.p_WB, Vec3(0, 0, 2));

  const auto& example = std::get<sim::ExampleModel>(scene.bodies.at(2).model);
  const auto& p = example.parameters;
  EXPECT_EQ((std::vector{p.alpha, p.beta, p.gamma, p.lambda, p.mu, p.nu, p.restitution, example.density, example.mass,
                         example.friction}),
            (std::vector{1., 2., 3., 0.5, 4., 5., 0.25, 10., 11., 1.5}));
  EXPECT_EQ(p.step, sim::example_based::ExampleParameters::Step::equation10);
  EXPECT_TRUE(p.raw_rates && p.triangle_collision && p.keep_volume);
  EXPECT_EQ(p.secondary_goal, sim::example_based::ExampleParameters::SecondaryGoal::smooth_weights);
  EXPECT_EQ((std::vector{p.goal_tolerance, p.fatigue_time}), (std::vector{0.01, 6.}));
}

TEST(SceneConvert, RotationsAreNormalisedQuaternionsOrRotationVectors) {
  const auto scene = convert(
      "bodies { name: 'a' pose { quaternion { w: 2 z: 2 } } rigid { shapes { box {} } } }"
      "bodies { name: 'b' pose { rotation_vector { z: 1.5707963267948966 } } rigid { shapes { box {} } } }"
      "bodies { name: 'c' pose { rotation_vector {} } rigid { shapes { box {} } } }");
  const Quat quarter(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  EXPECT_LT(scene.bodies.at(0).pose.R_WB.angularDistance(quarter), 1e-15);
  EXPECT_LT(scene.bodies.at(1).pose.R_WB.angularDistance(quarter), 1e-15);
  EXPECT_EQ(scene.bodies.at(2).pose.R_WB.w(), 1);
}

TEST(SceneConvert, GeneratedBlocksHaveTheirSizeAndCells) {
  const auto scene = convert(
      "bodies { name: 'pane' fem { mesh { pane { width: 3 height: 2 thickness: 0.1 cells { x: 6 y: 4 z: 1 } } } } }"
      "bodies { name: 'beam' fem { mesh { scale: 2 beam { length: 1 height: 0.2 depth: 0.3"
      "  cells { x: 5 y: 1 z: 2 lattice: FEMFX } } } } }"
      "bodies { name: 'box' fem { mesh { box { cells { x: 1 y: 1 z: 1 lattice: BCC } } } } }");
  const auto box = [&](int i) {
    Eigen::AlignedBox3d b;
    for (const Vec3& p : std::get<sim::FemModel>(scene.bodies.at(i).model).mesh->X) b.extend(p);
    return b;
  };
  const auto tets = [&](int i) { return std::get<sim::FemModel>(scene.bodies.at(i).model).mesh->tet_count(); };
  EXPECT_EQ(tets(0), 6 * 24);
  EXPECT_TRUE(box(0).sizes().isApprox(Vec3(3, 2, 0.1)));
  EXPECT_LT(box(0).center().norm(), 1e-12);
  EXPECT_EQ(tets(1), 60);
  EXPECT_TRUE(box(1).min().isApprox(Vec3(0, 0, -0.6)));
  EXPECT_TRUE(box(1).max().isApprox(Vec3(2, 0.4, 0)));
  EXPECT_EQ(tets(2), 12);
}

TEST(SceneConvert, ElementsAreChosenByName) {
  using sim::fem::ElementKind;
  for (const auto& [name, kind] : {std::pair{"LINEAR_TETRAHEDRA", ElementKind::linear_tetrahedra}, {"SMOOTHED_OCTAHEDRA", ElementKind::smoothed_octahedra},
                                   {"HEXAHEDRA", ElementKind::hexahedra}}) {
    const auto scene = convert(std::string("bodies { name: 'plank' fem { mesh { box { cells { x: 4 y: 1 z: 1 } } } element: ") + name + " } }");
    EXPECT_EQ(std::get<sim::FemModel>(scene.bodies.at(0).model).element, kind);
  }
  const auto unknown = to_scene(parse<v1::Scene>("bodies { name: 'plank' fem { mesh { box { cells { x: 4 y: 1 z: 1 } } } element: 9 } }"), NoFiles());
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().text().find("element is 9, must be LINEAR_TETRAHEDRA, SMOOTHED_OCTAHEDRA or HEXAHEDRA"), std::string::npos) << unknown.error().text();
}

TEST(SceneConvert, EqualSourcesShareOneMesh) {
  const auto scene = convert(
      "bodies { name: 'a' fem { mesh { box {} } } } bodies { name: 'b' fem { mesh { box {} } } }"
      "bodies { name: 'c' fem { mesh { box {} scale: 2 } } }");
  const auto mesh = [&](int i) { return std::get<sim::FemModel>(scene.bodies.at(i).model).mesh; };
  EXPECT_EQ(mesh(0), mesh(1));
  EXPECT_NE(mesh(0), mesh(2));
}

TEST(SceneConvert, SplintersAreOfTheRenderedSurfaceOrOfTheTets) {
  const auto scene = convert(
      "bodies { name: 'a' fem { mesh { box { size { x: 2 y: 1 z: 1 } } } splinters { stone { size: 0.5 } } } }"
      "bodies { name: 'b' fem { mesh { box { size { x: 2 y: 1 z: 1 } } } splinters { stone { size: 0.5 } } } }"
      "bodies { name: 'c' fem { mesh { box { size { x: 2 y: 1 z: 1 } } } splinters { stone { size: 0.5 } seed: 2 } } }"
      "bodies { name: 'd' fem { mesh { box { size { x: 2 y: 1 z: 1 } } } render { sphere { radius: 0.4 } } splinters { brick {} } } }"
      "bodies { name: 'e' fem { mesh { box {} } render { sphere { radius: 0.4 } } splinters { given {} } } }");
  const auto splinters = [&](int i) { return std::get<sim::FemModel>(scene.bodies.at(i).model).splinters; };
  const auto box = [&](int i) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : splinters(i)->surface.vertices) box.extend(p);
    return box;
  };
  EXPECT_EQ(splinters(0), splinters(1));
  EXPECT_NE(splinters(0)->surface.vertices, splinters(2)->surface.vertices);
  EXPECT_GE(splinters(0)->count, 4 * 2 * 2);
  EXPECT_TRUE(box(0).max().isApprox(Vec3(1, 0.5, 0.5), 1e-12));
  EXPECT_GT(splinters(3)->count, 40);
  EXPECT_TRUE(box(3).max().isApprox(Vec3(0.4, 0.4, 0.4), 1e-12));
  EXPECT_EQ(splinters(4)->count, 1);
}

TEST(SceneConvert, FacesBoxesAndIdsSelectNodes) {
  const auto scene = convert(
      "bodies { name: 'b' fem { mesh { box { cells { x: 2 y: 2 z: 2 } } }"
      "  motions { nodes { face: 'x_min' } } motions { nodes { face: 'x_max' } }"
      "  motions { nodes { box { min { x: -0.1 y: -0.5 z: -0.5 } max { x: 0.1 y: -0.4 z: 0.5 } } } } } }");
  const auto& fem = std::get<sim::FemModel>(scene.bodies.at(0).model);
  ASSERT_EQ(fem.motions.at(0).nodes.size(), 9u);
  for (const int node : fem.motions[0].nodes) EXPECT_EQ(fem.mesh->X[node].x(), -0.5);
  ASSERT_EQ(fem.motions.at(1).nodes.size(), 9u);
  for (const int node : fem.motions[1].nodes) EXPECT_EQ(fem.mesh->X[node].x(), 0.5);
  ASSERT_EQ(fem.motions.at(2).nodes.size(), 3u);
  for (const int node : fem.motions[2].nodes) EXPECT_EQ(fem.mesh->X[node].y(), -0.5);
}

// ---- regions -------------------------------------------------------------------------------------------------------
Vec3 centroid(const sim::TetMesh& mesh, int t) {
  Vec3 sum = Vec3::Zero();
  for (const int n : mesh.tets[static_cast<std::size_t>(t)]) sum += mesh.X[static_cast<std::size_t>(n)] / 4;
  return sum;
}

TEST(SceneConvert, BoxesSpheresPlanesAndIdsSelectTets) {
  const auto scene = convert(
      "bodies { name: 'b' fem { mesh { box { size { x: 2 y: 1 z: 1 } cells { x: 8 y: 4 z: 4 } } }"
      "  regions { tets { box { min { x: 0 y: -1 z: -1 } max { x: 0.5 y: 1 z: 1 } } } material { young: 1 } }"
      "  regions { tets { sphere { centre { x: -1 } radius: 0.4 } } material { young: 2 } }"
      "  regions { tets { plane { normal { x: -1 } offset: -0.75 } } material { young: 3 } }"
      "  regions { tets { plane { offset: -0.25 } } tets { ids { ids: [767, 700] } } material { young: 4 } } } }");
  const auto& fem = std::get<sim::FemModel>(scene.bodies.at(0).model);
  ASSERT_EQ(fem.regions.size(), 4u);
  ASSERT_EQ(fem.mesh->tet_count(), 768);
  std::vector<double> young(768, 0);
  for (const sim::fem::MaterialRegion& region : fem.regions)
    for (const int t : region.tets) {
      EXPECT_EQ(young[static_cast<std::size_t>(t)], 0);
      young[static_cast<std::size_t>(t)] = region.material.young;
    }
  for (int t = 0; t < 768; ++t) {
    const Vec3 p = centroid(*fem.mesh, t);
    double expected = 0;  // later regions win
    if (p.x() >= 0 && p.x() <= 0.5) expected = 1;
    if ((p - Vec3(-1, 0, 0)).norm() <= 0.4) expected = 2;
    if (p.x() > 0.75) expected = 3;
    if (p.y() < -0.25 || t == 767 || t == 700) expected = 4;
    EXPECT_EQ(young[static_cast<std::size_t>(t)], expected) << t;
  }
  for (const sim::fem::MaterialRegion& region : fem.regions) EXPECT_GT(region.tets.size(), 5u);
}

TEST(SceneConvert, TagsOfAMeshSelectTets) {
  const auto scene = convert(
      "bodies { name: 'b' fem { mesh { inline_mesh { positions: [0,0,0, 1,0,0, 0,1,0, 0,0,1, 1,1,1]"
      "  tets: [0,1,2,3, 1,4,2,3] tags: [7, -2] } }"
      "  material { friction: 0.7 cg_tolerance: 1e-5 cg_max_iterations: 90 fracture_interval: 3 max_splits_per_step: 4 fracture_order: LARGEST_FIRST"
      "    raw_toughness: true breakable: true density: 2000 }"
      "  regions { tets { tag: -2 } material { density: 5 yield: 0.1 } } } }");
  const auto& fem = std::get<sim::FemModel>(scene.bodies.at(0).model);
  EXPECT_EQ(fem.mesh->tags, (std::vector{7, -2}));
  ASSERT_EQ(fem.regions.size(), 1u);
  EXPECT_EQ(fem.regions[0].tets, (std::vector{1}));
  // Its own fields or the defaults, and what goes for the whole body from there.
  const sim::fem::FemMaterial& m = fem.regions[0].material;
  EXPECT_EQ(m.density, 5);
  EXPECT_EQ(m.yield, 0.1);
  EXPECT_EQ(m.young, sim::fem::FemMaterial().young);
  EXPECT_FALSE(m.breakable);
  EXPECT_EQ((std::vector{m.friction, m.cg_tolerance}), (std::vector{0.7, 1e-5}));
  EXPECT_EQ((std::vector{m.cg_max_iterations, m.fracture_interval, m.max_splits_per_step}), (std::vector{90, 3, 4}));
  EXPECT_TRUE(m.raw_toughness);
  EXPECT_EQ(m.fracture_order, sim::fem::FractureOrder::largest_first);
}

TEST(SceneConvert, TriangleBodiesGetTetsThatEncloseThem) {
  const auto scene = convert(
      "bodies { name: 'b' rigid { proxy_tets: 600 shapes { pose { position { x: 3 } } triangles { mesh { box {} } } } "
      "} }");
  const auto& rigid = std::get<sim::RigidModel>(scene.bodies.at(0).model);
  ASSERT_TRUE(rigid.proxy);
  EXPECT_LE(rigid.proxy->tet_count(), 600);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : rigid.proxy->X) box.extend(p);
  EXPECT_TRUE(box.contains(Eigen::AlignedBox3d(Vec3(2.5, -0.5, -0.5), Vec3(3.5, 0.5, 0.5))));
  double solid = 0;
  for (int t = 0; t < rigid.proxy->tet_count(); ++t) solid += signed_volume(*rigid.proxy, t) * rigid.proxy->fill[t];
  EXPECT_NEAR(solid, 1, 0.02);  // fills are sampled
}

TEST(SceneConvert, ScriptNamesBodies) {
  const auto scene =
      convert("bodies { name: 'a' rigid { shapes { box {} } } }" + fem_body("") +
              "script { time: 0.5 command { apply_impulse { body: 'a' impulse { x: 1 } point { y: 2 } radius: 3 } } }"
              "script { time: 0.5 command { apply_force { body: 'b' force { y: -4 } duration: 5 } } }"
              "script { time: 1 command { apply_node_impulse { body: 'b' nodes: [2, 1] impulse { z: 6 } } } }");
  ASSERT_EQ(scene.script.size(), 3u);
  const auto& impulse = std::get<sim::ApplyImpulse>(scene.script[0].command);
  EXPECT_EQ(impulse.body, 0u);
  EXPECT_EQ(impulse.impulse, Vec3(1, 0, 0));
  EXPECT_EQ(impulse.point, Vec3(0, 2, 0));
  EXPECT_EQ(impulse.radius, 3);
  const auto& force = std::get<sim::ApplyForce>(scene.script[1].command);
  EXPECT_EQ(force.body, 1u);
  EXPECT_EQ(force.force, Vec3(0, -4, 0));
  EXPECT_EQ(force.duration, 5);
  EXPECT_EQ(force.radius, sim::ApplyForce().radius);
  const auto& nodes = std::get<sim::ApplyNodeImpulse>(scene.script[2].command);
  EXPECT_EQ(nodes.nodes, (std::vector{2, 1}));
}

}  // namespace
}  // namespace crumple::scene_convert
