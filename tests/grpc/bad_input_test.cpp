// Bad input over the wire: one INVALID_ARGUMENT with the field's path, nothing created, and a world that runs all the
// while ends with the bits of one that was left alone.
#include "crumple/v1/error.pb.h"
#include "client/sdk/message_convert.h"
#include "server/grpc/simulation_server.h"
#include "tests/scene_convert/parse_scene.h"
#include "tests/support/running_server.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <thread>

namespace crumple::grpc_server {
namespace {

struct BadInput {
  const char* what;
  const char* text;  // text format, added to the small scene or, for commands, the command
  const char* field;
};

#define FEM(mesh, rest) "bodies { name: 'bad' fem { mesh { " mesh " } " rest " } }"
#define TET "positions: [0,0,0, 1,0,0, 0,1,0, 0,0,1] "
#define EXAMPLE(weights)                                                                                     \
  "bodies { name: 'bad' example { asset { inline_asset { mesh { " TET "tets: [0,1,2,3] } weights { " weights \
  " } "                                                                                                      \
  "examples { bones {} } convex_parts { vertices: [0,1,2,3] } } } } }"
#define ASSET_PATH "scene.bodies[3].example.asset.inline_asset."
#define MESH_PATH "scene.bodies[3].fem.mesh.inline_mesh."

const BadInput kScenes[] = {
    {"dt nan", "dt: nan", "scene.dt"},
    {"dt infinite", "dt: inf", "scene.dt"},
    {"dt zero", "dt: 0", "scene.dt"},
    {"dt huge", "dt: 1e300", "scene.dt"},
    {"gravity huge", "gravity { y: -1e5 }", "scene.gravity"},
    {"position nan", "bodies { name: 'bad' pose { position { x: nan } } rigid { shapes { box {} } } }",
     "scene.bodies[3].pose.position.x"},
    {"position infinite", "bodies { name: 'bad' pose { position { z: -inf } } rigid { shapes { box {} } } }",
     "scene.bodies[3].pose.position.z"},
    {"position huge", "bodies { name: 'bad' pose { position { x: 1e7 } } rigid { shapes { box {} } } }",
     "scene.bodies[3].pose.position"},
    {"velocity huge", "bodies { name: 'bad' velocity { x: 1e5 } rigid { shapes { box {} } } }",
     "scene.bodies[3].velocity"},
    {"radius nan", "bodies { name: 'bad' rigid { shapes { sphere { radius: nan } } } }",
     "scene.bodies[3].rigid.shapes[0].sphere.radius"},
    {"mass infinite", "bodies { name: 'bad' rigid { mass: inf shapes { box {} } } }", "scene.bodies[3].rigid.mass"},
    {"young nan", FEM("box {}", "material { young: nan }"), "scene.bodies[3].fem.material.young"},
    {"young huge", FEM("box {}", "material { young: 1e20 }"), "scene.bodies[3].fem.material.young"},
    {"poisson a half", FEM("box {}", "material { poisson_ratio: 0.5 }"), "scene.bodies[3].fem.material.poisson_ratio"},
    {"density zero", FEM("box {}", "material { density: 0 }"), "scene.bodies[3].fem.material.density"},
    {"density infinite", FEM("box {}", "material { density: inf }"), "scene.bodies[3].fem.material.density"},
    {"damping huge", FEM("box {}", "material { damping_stiffness: 1e9 }"),
     "scene.bodies[3].fem.material.damping_stiffness"},
    {"yield nan", FEM("box {}", "material { yield: nan }"), "scene.bodies[3].fem.material.yield"},
    {"empty mesh", FEM("inline_mesh {}", ""), MESH_PATH "tets"},
    {"nodes without tets", FEM("inline_mesh { " TET "}", ""), MESH_PATH "tets"},
    {"zero tet", FEM("inline_mesh { positions: [0,0,0, 1,0,0, 0,1,0, 1,1,0] tets: [0,1,2,3] }", ""),
     MESH_PATH "tets[0]"},
    {"tet of one node", FEM("inline_mesh { " TET "tets: [0,1,2,3, 1,1,1,1] }", ""), MESH_PATH "tets[1]"},
    {"inverted tet", FEM("inline_mesh { " TET "tets: [0,1,2,3, 1,0,2,3] }", ""), MESH_PATH "tets[1]"},
    {"sliver", FEM("inline_mesh { positions: [0,0,0, 1,0,0, 0,1,0, 0.3,0.3,1e-14] tets: [0,1,2,3] }", ""),
     MESH_PATH "tets[0]"},
    {"node id beyond the nodes", FEM("inline_mesh { " TET "tets: [0,1,2,4] }", ""), MESH_PATH "tets[0]"},
    {"node id negative", FEM("inline_mesh { " TET "tets: [0,1,2,-2147483648] }", ""), MESH_PATH "tets[0]"},
    {"node infinite", FEM("inline_mesh { positions: [0,0,0, 1,0,0, 0,inf,0, 0,0,1] tets: [0,1,2,3] }", ""),
     MESH_PATH "positions[2]"},
    {"held node id", FEM("box {}", "motions { nodes { ids { ids: [99] } } }"),
     "scene.bodies[3].fem.motions[0].nodes[0].ids.ids[0]"},
    {"tet id of a region", FEM("box {}", "regions { tets { ids { ids: [99] } } }"),
     "scene.bodies[3].fem.regions[0].tets[0].ids.ids[0]"},
    {"material of a region", FEM("box {}", "regions { tets { plane { offset: 9 } } material { young: -1 } }"),
     "scene.bodies[3].fem.regions[0].material.young"},
    {"ten million tets", FEM("box { cells { x: 1000 y: 1000 z: 2 } }", ""), "scene.bodies[3].fem.mesh.box.cells"},
    {"ten million enclosing tets", FEM("enclosing { surface { sphere {} } cell_size: 0.005 }", ""),
     "scene.bodies[3].fem.mesh.enclosing.cell_size"},
    {"weights that do not sum to one", EXAMPLE("bones: 2 dense { values: [1,0, 1,0, 0.5,0.6, 1,0] }"),
     ASSET_PATH "weights[2]"},
    {"weights negative", EXAMPLE("bones: 2 dense { values: [1,0, 1,0, -0.5,1.5, 1,0] }"), ASSET_PATH "weights[2][0]"},
    {"weights nan", EXAMPLE("bones: 1 dense { values: [1,nan,1,1] }"), ASSET_PATH "weights[1][0]"},
    {"bone id", EXAMPLE("bones: 1 sparse { row_start: [0,1,2,3,4] bone: [0,0,7,0] weight: [1,1,1,1] }"),
     ASSET_PATH "weights.sparse.bone[2]"},
    {"a file", FEM("file: '../../etc/passwd'", ""), "scene.bodies[3].fem.mesh.file"},
    {"a surface's file", FEM("enclosing { surface { file: '/etc/passwd.obj' } }", ""),
     "scene.bodies[3].fem.mesh.enclosing.surface.file"},
    {"script force nan", "script { command { apply_force { body: 'box' force { x: nan } } } }",
     "scene.script[0].command.apply_force.force.x"},
};

const BadInput kCommands[] = {
    {"force nan", "apply_force { body: 'box' force { x: nan } }", "command.apply_force.force.x"},
    {"force infinite", "apply_force { body: 'box' force { y: inf } }", "command.apply_force.force.y"},
    {"force huge", "apply_force { body: 'box' force { z: 1e13 } }", "command.apply_force.force"},
    {"force's point", "apply_force { body: 'box' point { x: 1e7 } }", "command.apply_force.point"},
    {"force's duration", "apply_force { body: 'box' duration: inf }", "command.apply_force.duration"},
    {"force's radius", "apply_force { body: 'cube' radius: nan }", "command.apply_force.radius"},
    {"impulse infinite", "apply_impulse { body: 'cube' impulse { x: -inf } }", "command.apply_impulse.impulse.x"},
    {"impulse huge", "apply_impulse { body: 'cube' impulse { x: 1e10 } }", "command.apply_impulse.impulse"},
    {"impulse's point nan", "apply_impulse { body: 'cube' point { z: nan } }", "command.apply_impulse.point.z"},
    {"impulse's radius", "apply_impulse { body: 'cube' radius: -1 }", "command.apply_impulse.radius"},
    {"node impulse nan", "apply_node_impulse { body: 'cube' nodes: 0 impulse { y: nan } }",
     "command.apply_node_impulse.impulse.y"},
    {"node id", "apply_node_impulse { body: 'cube' nodes: [0, 8] }", "command.apply_node_impulse.nodes[1]"},
    {"negative node id", "apply_node_impulse { body: 'cube' nodes: [-1] }", "command.apply_node_impulse.nodes[0]"},
    {"no nodes", "apply_node_impulse { body: 'cube' }", "command.apply_node_impulse.nodes"},
    {"nodes of a rigid body", "apply_node_impulse { body: 'box' nodes: 0 }", "command.apply_node_impulse.body"},
    {"parameters of a rigid body", "set_example_parameters { body: 'box' alpha: 1 }", "command.set_example_parameters.body"},
    {"a fixed body", "apply_force { body: 'ground' }", "command.apply_force.body"},
};

class BadInputOverTheWire : public testing::Test {
 protected:
  void SetUp() override {
    server_ = test::start_server();
    client_ = test::connect_to(*server_);
    stub_ = v1::SimulationService::NewStub(grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
    running_ = *client_->create_world(test::small_scene());
    ASSERT_TRUE(client_->play(running_));
  }

  // The world that ran all the while against one that nobody disturbs. Its clock is real: it may not have come to its
  // first step when everything above was refused.
  void TearDown() override {
    const auto end = std::chrono::steady_clock::now() + test::kDeadline;
    while (client_->world(running_)->status.step == 0 && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const auto step = client_->pause(running_);
    ASSERT_TRUE(step);
    ASSERT_GT(*step, 0u);
    const auto worlds = client_->list_worlds();
    ASSERT_TRUE(worlds);
    EXPECT_EQ(worlds->size(), 1u) << "something was created";
    const WorldId alone = *client_->create_world(test::small_scene());
    EXPECT_EQ(client_->world(running_, false, true)->state_hash, client_->step(alone, *step, true)->state_hash);
  }

  static void expect_refused(const grpc::Status& status, const BadInput& bad) {
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT) << bad.what << ": " << status.error_message();
    EXPECT_EQ(client::to_error(status).field, bad.field) << bad.what << ": " << status.error_message();
    EXPECT_TRUE(status.error_message().starts_with(bad.field)) << status.error_message();
  }
  grpc::Status create(const v1::Scene& scene) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + test::kDeadline);
    v1::CreateWorldRequest request;
    *request.mutable_scene() = scene;
    v1::CreateWorldResponse response;
    return stub_->CreateWorld(&context, request, &response);
  }

  std::unique_ptr<SimulationServer> server_;
  std::unique_ptr<client::SimulationClient> client_;
  std::unique_ptr<v1::SimulationService::Stub> stub_;
  WorldId running_ = 0;
};

TEST_F(BadInputOverTheWire, OfScenesCreatesNothing) {
  for (const BadInput& bad : kScenes) {
    v1::Scene scene = test::small_scene();
    scene.MergeFrom(test::parse<v1::Scene>(bad.text));
    expect_refused(create(scene), bad);
  }
}

TEST_F(BadInputOverTheWire, OfCommandsChangesNothing) {
  for (const BadInput& bad : kCommands) {
    const auto applied = client_->apply(running_, test::parse<v1::Command>(bad.text));
    ASSERT_FALSE(applied) << bad.what;
    EXPECT_EQ(applied.error().code, ErrorCode::invalid_argument) << bad.what;
    EXPECT_EQ(applied.error().field, bad.field) << bad.what << ": " << applied.error().text();
  }
  for (const double speed :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(client_->play(running_, speed).error().field, "speed") << speed;
}

// Not generated but sent: 40 MB of ids.
TEST_F(BadInputOverTheWire, OfTenMillionTetsIsRefusedWhole) {
  v1::Scene scene = test::parse<v1::Scene>(FEM("inline_mesh { " TET "}", ""));
  auto& tets = *scene.mutable_bodies(0)->mutable_fem()->mutable_mesh()->mutable_inline_mesh()->mutable_tets();
  tets.Reserve(40'000'000);
  for (int i = 0; i < 40'000'000; ++i) tets.Add(i % 4);
  const grpc::Status status = create(scene);
  expect_refused(status, {"ten million tets", "", "scene.bodies[0].fem.mesh.inline_mesh.tets"});
  EXPECT_NE(status.error_message().find("10000000 tets, must hold at most 2000000"), std::string::npos)
      << status.error_message();
}

}  // namespace
}  // namespace crumple::grpc_server
