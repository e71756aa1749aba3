#include "server/grpc/simulation_server.h"

#include <gtest/gtest.h>

#include <thread>

#include "client/sdk/message_convert.h"
#include "crumple/v1/error.pb.h"
#include "tests/grpc/generic_call.h"
#include "tests/support/child_process.h"
#include "tests/support/running_server.h"

namespace crumple::grpc_server {
namespace {

using Stub = v1::SimulationService::Stub;

std::unique_ptr<Stub> stub_of(const SimulationServer& server) {
  return v1::SimulationService::NewStub(grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials()));
}

std::unique_ptr<grpc::ClientContext> deadline() {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(std::chrono::system_clock::now() + test::kDeadline);
  return context;
}

TEST(SimulationServer, AnswersHealthChecks) {
  const auto server = test::start_server();
  // grpc.health.v1.HealthCheckRequest{service} -> HealthCheckResponse{SERVING}
  const std::string name = v1::SimulationService::service_full_name();
  for (const std::string& request : {std::string(), "\x0a" + std::string(1, static_cast<char>(name.size())) + name}) {
    const auto [status, answer] = test::generic_call(server->address(), "/grpc.health.v1.Health/Check", request);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(answer, "\x08\x01");
  }
}

TEST(SimulationServer, ReflectsItsServices) {
  const auto server = test::start_server();
  const auto [status, answer] = test::generic_call(
      server->address(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x00", 2));
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_NE(answer.find("crumple.v1.SimulationService"), std::string::npos);
}

TEST(SimulationServer, ErrorsCarryTheFieldInTheStatusDetails) {
  const auto server = test::start_server();
  v1::CreateWorldRequest request;
  *request.mutable_scene() = test::small_scene();
  request.mutable_scene()->set_dt(-1);
  v1::CreateWorldResponse response;
  const grpc::Status status = stub_of(*server)->CreateWorld(deadline().get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_TRUE(status.error_message().starts_with("scene.dt is -1")) << status.error_message();
  EXPECT_EQ(client::to_error(status).field, "scene.dt");
}

TEST(SimulationServer, RefusesARequestWithoutAScene) {
  const auto server = test::start_server();
  v1::CreateWorldResponse response;
  const grpc::Status status = stub_of(*server)->CreateWorld(deadline().get(), v1::CreateWorldRequest(), &response);
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
}

TEST(SimulationServer, RefusesMessagesBeyondItsLimitAndGoesOn) {
  const auto server = test::start_server();
  v1::CreateWorldRequest request;
  request.mutable_scene()->set_description(std::string(kMaxRequestBytes + 1, 'x'));
  v1::CreateWorldResponse response;
  EXPECT_EQ(stub_of(*server)->CreateWorld(deadline().get(), request, &response).error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(test::connect_to(*server)->create_world(test::small_scene()));
}

// What a stream that begins with these requests ends with.
grpc::Status end_of_stream(const SimulationServer& server, const std::vector<v1::WatchRequest>& requests) {
  const auto stub = stub_of(server);
  const auto context = deadline();
  const auto stream = stub->Watch(context.get());
  for (const v1::WatchRequest& request : requests) stream->Write(request);
  v1::WatchResponse response;
  while (stream->Read(&response)) {}
  return stream->Finish();
}

TEST(SimulationServer, StreamsThatBreakTheProtocolEnd) {
  const auto server = test::start_server();
  const WorldId world = *test::connect_to(*server)->create_world(test::small_scene());
  v1::WatchRequest credits, subscribe, bad_codec, bad_rate, unknown;
  credits.set_credits(1);
  subscribe.mutable_subscribe()->set_world(world);
  bad_codec = bad_rate = unknown = subscribe;
  bad_codec.mutable_subscribe()->set_codec(static_cast<v1::Codec>(77));
  bad_rate.mutable_subscribe()->set_max_rate_hz(std::nan(""));
  unknown.mutable_subscribe()->set_world(99);
  EXPECT_EQ(end_of_stream(*server, {credits}).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(end_of_stream(*server, {subscribe, subscribe}).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(end_of_stream(*server, {subscribe, v1::WatchRequest()}).error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(client::to_error(end_of_stream(*server, {bad_codec})).field, "subscribe.codec");
  EXPECT_EQ(client::to_error(end_of_stream(*server, {bad_rate})).field, "subscribe.max_rate_hz");
  EXPECT_EQ(end_of_stream(*server, {unknown}).error_code(), grpc::NOT_FOUND);
}

TEST(SimulationServer, AStreamThatTheClientClosesEndsWell) {
  const auto server = test::start_server();
  const WorldId world = *test::connect_to(*server)->create_world(test::small_scene());
  const auto stub = stub_of(*server);
  const auto context = deadline();
  const auto stream = stub->Watch(context.get());
  v1::WatchRequest subscribe;
  subscribe.mutable_subscribe()->set_world(world);
  stream->Write(subscribe);
  stream->WritesDone();
  v1::WatchResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST(SimulationServer, AClientKilledInMidStreamCostsNothing) {
  const auto server = test::start_server();
  const auto client = test::connect_to(*server);
  const WorldId world = *client->create_world(test::small_scene());
  const WorldId other = *client->create_world(test::small_scene());
  const WorldId alone = *client->create_world(test::small_scene());
  ASSERT_TRUE(client->play(world));
  test::ChildProcess viewer({test::program("crumple"), "--server", server->address(), "watch", std::to_string(world)});
  ASSERT_TRUE(viewer.started());
  ASSERT_TRUE(viewer.read_line().starts_with("step "));
  ASSERT_EQ(client->world(world)->status.viewers, 1);
  ASSERT_TRUE(client->step(other, 10));
  EXPECT_EQ(viewer.end(SIGKILL), -SIGKILL);
  ASSERT_TRUE(client->step(other, 10));
  const auto give_up = std::chrono::steady_clock::now() + test::kDeadline;
  while (client->world(world)->status.viewers > 0 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  EXPECT_EQ(client->world(world)->status.viewers, 0);
  EXPECT_EQ(client->world(world)->status.state, WorldState::playing);
  EXPECT_EQ(client->world(other, false, true)->state_hash, client->step(alone, 20, true)->state_hash);
}

// Credits are given without end and nothing is read, until flow control holds the server's writes back.
TEST(SimulationServer, AClientThatNeverReadsHoldsNobodyUp) {
  const auto server = test::start_server();
  const auto client = test::connect_to(*server);
  const WorldId world = *client->create_world(test::small_scene());
  const auto stub = stub_of(*server);
  const auto context = deadline();
  const auto stream = stub->Watch(context.get());
  v1::WatchRequest subscribe;
  subscribe.mutable_subscribe()->set_world(world);
  subscribe.mutable_subscribe()->set_codec(v1::FLOAT_32);
  subscribe.mutable_subscribe()->set_credits(1024);
  stream->Write(subscribe);
  const auto reading = *client->watch(world);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(client->step(world, 1));
  std::uint64_t step = 0;
  while (step < 300) {
    const auto update = reading->next(test::kDeadline);
    ASSERT_TRUE(update && *update);
    if (const auto* frame = std::get_if<Frame>(&**update)) step = frame->step;
  }
  context->TryCancel();
  stream->Finish();
}

TEST(SimulationServer, StoppingEndsStreamsAndCalls) {
  auto server = test::start_server();
  const auto client = test::connect_to(*server);
  const WorldId world = *client->create_world(test::small_scene());
  const auto stream = *client->watch(world);
  std::jthread stepping([&] {
    const auto result = client->step(world, runtime::WorldRunner::kMaxSteps);
    EXPECT_TRUE(!result && result.error().code == ErrorCode::unavailable);
  });
  while (client->world(world)->status.state != WorldState::stepping) std::this_thread::yield();
  server->stop();
  Result<std::optional<client::Update>> update = stream->next(test::kDeadline);
  while (update && *update) update = stream->next(test::kDeadline);
  ASSERT_FALSE(update);
  EXPECT_EQ(update.error().code, ErrorCode::unavailable);
}

TEST(SimulationServer, TwoDoNotShareAPort) {
  const auto first = test::start_server();
  const auto second = SimulationServer::start({.listen = first->address()});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::unavailable);
}

TEST(SimulationServer, ManyClientsCreateAndStepAtOnce) {
  const auto server = test::start_server();
  std::vector<std::uint64_t> hashes(4);
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t& hash : hashes)
      threads.emplace_back([&] {
        const auto client = test::connect_to(*server);
        const WorldId world = client->create_world(test::small_scene()).value_or(0);
        hash = client->step(world, 50, true).value_or(StepSummary()).state_hash;
      });
  }
  EXPECT_NE(hashes[0], 0u);
  for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

// All six parameters of Jones et al. 2016 in one call, while the world is there: what fell and dented before does not yield any more.
TEST(SimulationServer, ParametersOfExampleBodiesChangeInARunningWorld) {
  const auto server = test::start_server();
  const auto client = test::connect_to(*server);
  v1::Scene scene;
  scene.set_dt(0.004);
  v1::Body& ground = *scene.add_bodies();
  ground.set_name("ground");
  ground.mutable_rigid()->set_kind(v1::RigidBody::FIXED);
  ground.mutable_rigid()->add_shapes()->mutable_plane();
  v1::Body& barrel = *scene.add_bodies();
  barrel.set_name("barrel");
  barrel.mutable_pose()->mutable_position()->set_y(1);
  barrel.mutable_example()->mutable_asset()->mutable_barrel();
  barrel.mutable_example()->set_mass(20);
  int dents[2];
  for (const bool change : {false, true}) {
    const auto world = client->create_world(scene);
    ASSERT_TRUE(world) << world.error().text();
    if (change) {
      v1::Command command;
      v1::SetExampleParameters& set = *command.mutable_set_example_parameters();
      set.set_body("barrel");
      set.set_alpha(1);
      set.set_beta(1e9);
      set.set_gamma(0.2);
      set.set_lambda(0.5);
      set.set_mu(1);
      set.set_nu(0);
      const auto applied = client->apply(*world, command);
      ASSERT_TRUE(applied) << applied.error().text();
    }
    const auto stepped = client->step(*world, 150);
    ASSERT_TRUE(stepped) << stepped.error().text();
    dents[change] = stepped->plastic_impulses;
  }
  EXPECT_GT(dents[0], 0);
  EXPECT_EQ(dents[1], 0);
}

}  // namespace
}  // namespace crumple::grpc_server
