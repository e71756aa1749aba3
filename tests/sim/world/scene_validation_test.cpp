#include "server/sim/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace crumple::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TetMesh one_tet() { return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, {{0, 1, 2, 3}}, {}}; }

example_based::ExampleSet two_bones() {
  example_based::ExampleSet set;
  set.mesh = one_tet();
  set.W = Eigen::MatrixXd::Constant(4, 2, 0.5);
  set.examples = {{"rest", std::vector<example_based::BoneTransform>(2)}};
  set.convex_parts = {{0, 1, 2, 3}};
  return set;
}

RigidModel ball() {
  RigidModel model;
  model.shapes = {{Pose(), Sphere{0.5}}};
  return model;
}

// A ball, a tet of finite elements and a tet by example, and an impulse on the ball.
SceneDescription good() {
  SceneDescription scene;
  scene.bodies.resize(3);
  scene.bodies[0].name = "ball";
  scene.bodies[0].model = ball();
  FemModel fem;
  fem.mesh = std::make_shared<TetMesh>(one_tet());
  fem.motions = {{{0, 1}, {}}};
  scene.bodies[1].name = "jelly";
  scene.bodies[1].model = fem;
  ExampleModel example;
  example.set = std::make_shared<example_based::ExampleSet>(two_bones());
  scene.bodies[2].name = "can";
  scene.bodies[2].model = example;
  scene.script = {{0.5, ApplyImpulse{0, Vec3(1, 0, 0), Vec3::Zero()}}};
  return scene;
}

RigidModel& rigid(SceneDescription& s) { return std::get<RigidModel>(s.bodies[0].model); }
FemModel& fem(SceneDescription& s) { return std::get<FemModel>(s.bodies[1].model); }
ExampleModel& example(SceneDescription& s) { return std::get<ExampleModel>(s.bodies[2].model); }
void set_mesh(SceneDescription& s, const TetMesh& mesh) { fem(s).mesh = std::make_shared<TetMesh>(mesh); }
void set_set(SceneDescription& s, const example_based::ExampleSet& set) {
  example(s).set = std::make_shared<example_based::ExampleSet>(set);
}

struct Breach {
  const char* what;
  std::function<void(SceneDescription&)> spoil;
  const char* field;
  const char* rule;  // part of the message
};
void PrintTo(const Breach& b, std::ostream* out) { *out << b.what; }

class SceneGate : public testing::TestWithParam<Breach> {};

TEST(SceneValidation, TakesAGoodScene) {
  const auto result = validate(good());
  EXPECT_TRUE(result) << result.error().text();
}

TEST_P(SceneGate, NamesFieldValueAndRule) {
  SceneDescription scene = good();
  GetParam().spoil(scene);
  const auto result = validate(scene);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(result.error().field, GetParam().field) << result.error().text();
  EXPECT_NE(result.error().message.find(GetParam().rule), std::string::npos) << result.error().text();
}

using S = SceneDescription;
const Breach kBreaches[] = {
    {"gravity_nan", [](S& s) { s.gravity.y() = kNan; }, "gravity.y", "nan, must be finite"},
    {"gravity_huge", [](S& s) { s.gravity.y() = -2e4; }, "gravity", "at most 10000"},
    {"dt_zero", [](S& s) { s.dt = 0; }, "dt", "is 0, must be at least 1e-06"},
    {"dt_nan", [](S& s) { s.dt = kNan; }, "dt", "must be a number"},
    {"dt_long", [](S& s) { s.dt = 0.25; }, "dt", "is 0.25, must be at most 0.2"},
    {"substeps", [](S& s) { s.rigid_substeps = 0; }, "rigid_substeps", "at least 1"},
    {"sweeps", [](S& s) { s.rigid_iterations = 0; }, "rigid_iterations", "at least 1"},
    {"kappa", [](S& s) { s.contact.kappa = -1; }, "contact.kappa", "at least 0"},
    {"sleep_speed", [](S& s) { s.sleep.speed = 11; }, "sleep.speed", "is 11, must be at most 10"},
    {"sleep_time", [](S& s) { s.sleep.time = -1; }, "sleep.time", "at least 0"},
    {"wake_nan", [](S& s) { s.sleep.wake_acceleration = kNan; }, "sleep.wake_acceleration", "must be a number"},
    {"asleep_moves",
     [](S& s) {
       s.bodies[0].asleep = true;
       s.bodies[0].angular_velocity = Vec3(0, 1, 0);
     },
     "bodies[0].asleep", "has a velocity"},
    {"asleep_fixed",
     [](S& s) {
       rigid(s).kind = RigidKind::fixed;
       s.script.clear();
       s.bodies[0].asleep = true;
     },
     "bodies[0].asleep", "FIXED or KINEMATIC"},
    {"position", [](S& s) { s.bodies[0].pose.p_WB.x() = 2e6; }, "bodies[0].pose.position", "at most 1e+06"},
    {"position_inf", [](S& s) { s.bodies[2].pose.p_WB.z() = kInf; }, "bodies[2].pose.position.z", "finite"},
    {"rotation", [](S& s) { s.bodies[0].pose.R_WB.w() = 2; }, "bodies[0].pose.quaternion", "unit length"},
    {"velocity", [](S& s) { s.bodies[1].velocity.x() = kNan; }, "bodies[1].velocity.x", "finite"},
    {"spin", [](S& s) { s.bodies[1].angular_velocity.x() = 1e5; }, "bodies[1].angular_velocity", "at most"},
    {"colour", [](S& s) { s.bodies[1].colour[1] = 1.5f; }, "bodies[1].colour.g", "is 1.5, must be at most 1"},
    {"no_name", [](S& s) { s.bodies[1].name = ""; }, "bodies[1].name", "empty"},
    {"same_name", [](S& s) { s.bodies[2].name = "ball"; }, "bodies[2].name", "must differ from that of bodies[0]"},

    {"no_shape", [](S& s) { rigid(s).shapes.clear(); }, "bodies[0].rigid.shapes", "at least 1"},
    {"radius", [](S& s) { rigid(s).shapes[0].shape = Sphere{0}; }, "bodies[0].rigid.shapes[0].sphere.radius",
     "is 0, must be at least"},
    {"box", [](S& s) { rigid(s).shapes[0].shape = Box{Vec3(1, kNan, 1)}; },
     "bodies[0].rigid.shapes[0].box.half_extents.y", "number"},
    {"moving_plane", [](S& s) { rigid(s).shapes[0].shape = Plane(); }, "bodies[0].rigid.shapes[0].plane", "FIXED"},
    {"plane_normal",
     [](S& s) {
       rigid(s).kind = RigidKind::fixed;
       rigid(s).shapes[0].shape = Plane{Vec3(0, 0, 0.5), 0};
       s.script.clear();
     },
     "bodies[0].rigid.shapes[0].plane.normal", "has length 0.5, must have unit length"},
    {"flat_hull",
     [](S& s) {
       rigid(s).shapes[0].shape = ConvexHull{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(1, 1, 0)}};
     },
     "bodies[0].rigid.shapes[0].convex_hull.points", "in one plane"},
    {"small_hull", [](S& s) { rigid(s).shapes[0].shape = ConvexHull{{Vec3::Zero()}}; },
     "bodies[0].rigid.shapes[0].convex_hull.points", "at least 4"},
    {"inside_out",
     [](S& s) {
       SurfaceMesh mesh{one_tet().X, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
       rigid(s).shapes[0].shape = TriangleShape{mesh};
     },
     "bodies[0].rigid.shapes[0].triangles.mesh", "inside out"},
    {"triangle_ids",
     [](S& s) {
       rigid(s).shapes[0].shape = TriangleShape{SurfaceMesh{one_tet().X, {{0, 1, 9}}}};
     },
     "bodies[0].rigid.shapes[0].triangles.mesh.triangles[0]", "9"},
    {"density", [](S& s) { rigid(s).density = 0; }, "bodies[0].rigid.density", "is 0, must be above 0"},
    {"mass", [](S& s) { rigid(s).mass = -1; }, "bodies[0].rigid.mass", "at least 0"},
    {"restitution", [](S& s) { rigid(s).restitution = 1.1; }, "bodies[0].rigid.restitution", "at most 1"},
    {"motion_of_dynamic", [](S& s) { rigid(s).motion.resize(1); }, "bodies[0].rigid.motion", "KINEMATIC"},
    {"key_order",
     [](S& s) {
       rigid(s).kind = RigidKind::kinematic;
       rigid(s).motion = {{1, Pose()}, {1, Pose()}};
       s.script.clear();
     },
     "bodies[0].rigid.motion[1].time", "must be above the key before it"},

    {"young", [](S& s) { fem(s).material.young = kInf; }, "bodies[1].fem.material.young", "is inf, must be finite"},
    {"young_huge", [](S& s) { fem(s).material.young = 1e14; }, "bodies[1].fem.material.young", "at most 1e+13"},
    {"poisson", [](S& s) { fem(s).material.poisson = 0.5; }, "bodies[1].fem.material.poisson_ratio",
     "is 0.5, must be below 0.5"},
    {"poisson_low", [](S& s) { fem(s).material.poisson = -0.1; }, "bodies[1].fem.material.poisson_ratio",
     "is -0.1, must be at least 0"},
    {"toughness", [](S& s) { fem(s).material.toughness = 0; }, "bodies[1].fem.material.toughness", "above 0"},
    {"yield", [](S& s) { fem(s).material.yield = kNan; }, "bodies[1].fem.material.yield", "number"},
    {"creep", [](S& s) { fem(s).material.creep = 2; }, "bodies[1].fem.material.creep", "at most 1"},
    {"cg", [](S& s) { fem(s).material.cg_max_iterations = 0; }, "bodies[1].fem.material.cg_max_iterations",
     "at least 1"},
    {"no_mesh", [](S& s) { fem(s).mesh = nullptr; }, "bodies[1].fem.mesh", "missing"},
    {"empty_mesh", [](S& s) { set_mesh(s, TetMesh()); }, "bodies[1].fem.mesh.tets", "empty"},
    {"zero_tet",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.X[3] = Vec3(0.2, 0.2, 0);
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tets[0]", "volume 0"},
    {"sliver",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.X[3] = Vec3(0.2, 0.2, 1e-13);
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tets[0]", "volume"},
    {"inverted",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.X[3] = Vec3(0, 0, -1);
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tets[0]", "volume -0.16"},
    {"tet_ids",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.tets[0][2] = 4;
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tets[0]", "names node 4"},
    {"ten_million_tets",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.tets.resize(10'000'000, mesh.tets[0]);
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tets", "10000000 tets, must hold at most 2000000"},
    {"node_far_away",
     [](S& s) {
       TetMesh mesh = one_tet();
       for (Vec3& p : mesh.X) p *= 2e6;
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.X[1]", "at most 1e+06"},
    {"no_nodes", [](S& s) { fem(s).motions[0].nodes.clear(); }, "bodies[1].fem.motions[0].nodes", "empty"},
    {"node_ids", [](S& s) { fem(s).motions[0].nodes = {4}; }, "bodies[1].fem.motions[0].nodes", "names node 4"},
    {"node_twice",
     [](S& s) {
       fem(s).motions.push_back({{1}, {}});
     },
     "bodies[1].fem.motions[1].nodes", "again"},
    {"region_tets", [](S& s) { fem(s).regions = {{{0}, {}}, {{}, {}}}; }, "bodies[1].fem.regions[1].tets", "empty"},
    {"region_ids", [](S& s) { fem(s).regions = {{{1}, {}}}; }, "bodies[1].fem.regions[0].tets",
     "names tet 1, must be below the mesh's 1 tets"},
    {"region_twice", [](S& s) { fem(s).regions = {{{0}, {}}, {{0}, {}}}; }, "bodies[1].fem.regions[1].tets", "again"},
    {"region_young", [](S& s) { fem(s).regions = {{{0}, {.young = kNan}}}; }, "bodies[1].fem.regions[0].material.young",
     "number"},
    {"region_density", [](S& s) { fem(s).regions = {{{0}, {.density = 1e7}}}; },
     "bodies[1].fem.regions[0].material.density", "at most 1e+06"},
    {"region_friction", [](S& s) { fem(s).regions = {{{0}, {.friction = 0.9}}}; },
     "bodies[1].fem.regions[0].material.friction", "is 0.9, must be that of the body's material (0.4)"},
    {"too_many_regions", [](S& s) { fem(s).regions.assign(1001, {{0}, {}}); }, "bodies[1].fem.regions", "at most 1000"},
    {"tags",
     [](S& s) {
       TetMesh mesh = one_tet();
       mesh.tags = {1, 2};
       set_mesh(s, mesh);
     },
     "bodies[1].fem.mesh.tags", "holds 2 values"},
    {"clamp", [](S& s) { fem(s).clamp_limit = -1; }, "bodies[1].fem.clamp_limit", "at least 0"},
    {"rigid_fragments", [](S& s) { fem(s).rigid_fragments = -1; }, "bodies[1].fem.rigid_fragments", "at least 0"},

    {"no_set", [](S& s) { example(s).set = nullptr; }, "bodies[2].example.asset", "missing"},
    {"weight_sum",
     [](S& s) {
       auto set = two_bones();
       set.W(3, 1) = 0.6;
       set_set(s, set);
     },
     "bodies[2].example.asset.W[3]", "sums to 1.1, must sum to 1"},
    {"weights_nan",
     [](S& s) {
       auto set = two_bones();
       set.W(0, 0) = kNan;
       set_set(s, set);
     },
     "bodies[2].example.asset.W[0][0]", "nan"},
    {"lambda", [](S& s) { example(s).parameters.lambda = 1; }, "bodies[2].example.parameters.lambda",
     "is 1, must be below 1"},
    {"goal_tolerance", [](S& s) { example(s).parameters.goal_tolerance = 0.2; }, "bodies[2].example.parameters.goal_tolerance", "at most 0.1"},
    {"fatigue_time", [](S& s) { example(s).parameters.fatigue_time = -1; }, "bodies[2].example.parameters.fatigue_time", "at least 0"},
    {"two_collisions", [](S& s) { example(s).parameters.triangle_collision = example(s).parameters.tet_collision = true; },
     "bodies[2].example.parameters.tet_collision", "at most one"},
    {"gamma", [](S& s) { example(s).parameters.gamma = 0; }, "bodies[2].example.parameters.gamma", "above 0"},
    {"alpha", [](S& s) { example(s).parameters.alpha = kInf; }, "bodies[2].example.parameters.alpha", "finite"},

    {"impulse_huge",
     [](S& s) {
       s.script[0].command = ApplyImpulse{0, Vec3(2e9, 0, 0), Vec3::Zero()};
     },
     "script[0].command.apply_impulse.impulse", "at most 1e+09"},
    {"force_nan",
     [](S& s) {
       s.script[0].command = ApplyForce{0, Vec3(kNan, 0, 0), Vec3::Zero()};
     },
     "script[0].command.apply_force.force.x", "finite"},
    {"force_huge",
     [](S& s) {
       s.script[0].command = ApplyForce{0, Vec3(0, 1e13, 0), Vec3::Zero()};
     },
     "script[0].command.apply_force.force", "at most 1e+12"},
    {"point",
     [](S& s) {
       s.script[0].command = ApplyForce{0, Vec3::Zero(), Vec3(0, kInf, 0)};
     },
     "script[0].command.apply_force.point.y", "finite"},
    {"no_body", [](S& s) { s.script[0].command = ApplyForce{3}; }, "script[0].command.apply_force.body", "body 3"},
    {"fixed_body", [](S& s) { rigid(s).kind = RigidKind::fixed; }, "script[0].command.apply_impulse.body", "FIXED"},
    {"nodes_of_rigid",
     [](S& s) {
       s.script[0].command = ApplyNodeImpulse{0, {0}, Vec3::Zero()};
     },
     "script[0].command.apply_node_impulse.body", "finite-element"},
    {"node_of_script",
     [](S& s) {
       s.script[0].command = ApplyNodeImpulse{1, {0, 4}, Vec3::Zero()};
     },
     "script[0].command.apply_node_impulse.nodes[1]", "is 4"},
    {"script_order",
     [](S& s) {
       s.script.push_back({0.25, s.script[0].command});
     },
     "script[1].time", "below"},
    {"joint_body", [](S& s) { s.joints = {{0, 3}}; }, "joints[0].b", "is body 3"},
    {"joint_fem", [](S& s) { s.joints = {{1, 0}}; }, "joints[0].a", "must not be a finite-element body"},
    {"joint_itself", [](S& s) { s.joints = {{0, 0}}; }, "joints[0].b", "another body"},
    {"joint_strength", [](S& s) { s.joints = {{0, 2, Vec3::Zero(), -1}}; }, "joints[0].strength", "at least 0"},
    {"joint_bending", [](S& s) { s.joints = {{0, 2, Vec3::Zero(), 0, kNan}}; }, "joints[0].bending", "number"},
    {"joint_point", [](S& s) { s.joints = {{0, 2, Vec3(kNan, 0, 0)}}; }, "joints[0].position.x", "finite"},
    {"joint_time", [](S& s) { s.joint_time = -1; }, "joint_time", "at least 0"},
    {"joint_breaks", [](S& s) { s.max_breaks_per_step = 0; }, "max_breaks_per_step", "at least 1"},
    {"script_time", [](S& s) { s.script[0].time = kNan; }, "script[0].time", "number"},
};

INSTANTIATE_TEST_SUITE_P(SceneValidation, SceneGate, testing::ValuesIn(kBreaches),
                         [](const auto& info) { return std::string(info.param.what); });

TEST(SceneValidation, NamesTheFirstBreachOnly) {
  SceneDescription scene = good();
  scene.bodies[0].pose.p_WB.x() = kNan;
  scene.dt = -1;
  const auto result = validate(scene);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().field, "dt");
}

TEST(SceneValidation, AllowsInfiniteYieldAndToughness) {
  SceneDescription scene = good();
  fem(scene).material.breakable = true;  // both are infinite by default
  EXPECT_TRUE(validate(scene));
}

TEST(SceneValidation, CountsTheTetsOfAllBodies) {
  SceneDescription scene = good();
  TetMesh half = one_tet();  // 1.5 million tets that pass one by one
  half.tets.resize(1'500'000, half.tets[0]);
  set_mesh(scene, half);
  ASSERT_TRUE(validate(scene));
  scene.bodies.push_back(scene.bodies[1]);
  scene.bodies[3].name = "second";
  const auto result = validate(scene);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().field, "bodies[3]");
  EXPECT_NE(result.error().message.find("3000001 tets"), std::string::npos) << result.error().text();
}

}  // namespace
}  // namespace crumple::sim
