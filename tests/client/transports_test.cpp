// The same calls over gRPC and in process: same answers, same bits.
#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <limits>

#include "client/sdk/in_process_client.h"
#include "server/scene_convert/scene_convert.h"
#include "server/sim/world.h"
#include "tests/support/running_server.h"

namespace crumple::client {
namespace {

using std::chrono::milliseconds;

// A world registry with a client, through one of the transports.
struct Transport {
  std::unique_ptr<grpc_server::SimulationServer> server;
  std::unique_ptr<runtime::WorldRegistry> registry;
  std::unique_ptr<SimulationClient> client;
};

Transport over_grpc(const runtime::RegistryOptions& options) {
  Transport transport;
  transport.server = test::start_server({.registry = options});
  transport.client = test::connect_to(*transport.server);
  return transport;
}

Transport in_this_process(const runtime::RegistryOptions& options) {
  Transport transport;
  transport.registry = std::make_unique<runtime::WorldRegistry>(options);
  transport.client = in_process(*transport.registry);
  return transport;
}

struct Case {
  const char* name;
  Transport (*make)(const runtime::RegistryOptions&);
};

void PrintTo(const Case& transport, std::ostream* out) { *out << transport.name; }

class Transports : public testing::TestWithParam<Case> {
 protected:
  void start(const runtime::RegistryOptions& options = {}) {
    transport_ = GetParam().make(options);
    client_ = transport_.client.get();
  }
  WorldId create() {
    const auto world = client_->create_world(test::small_scene());
    EXPECT_TRUE(world) << world.error().text();
    return world.value_or(0);
  }
  std::uint64_t hash(WorldId world) { return client_->world(world, false, true)->state_hash; }

  Transport transport_;
  SimulationClient* client_ = nullptr;
};

INSTANTIATE_TEST_SUITE_P(Both, Transports,
                         testing::Values(Case{"Grpc", over_grpc}, Case{"InProcess", in_this_process}),
                         [](const auto& info) { return info.param.name; });

// The next update of a kind; others are dropped.
template <class Kind>
std::optional<Kind> next_of(WatchStream& stream) {
  while (true) {
    auto update = stream.next(test::kDeadline);
    EXPECT_TRUE(update) << update.error().text();
    if (!update || !*update) return std::nullopt;
    if (auto* kind = std::get_if<Kind>(&**update)) return std::move(*kind);
  }
}

v1::ScriptedCommand kick_at(double time) {
  v1::ScriptedCommand scripted;
  scripted.set_time(time);
  *scripted.mutable_command() = impulse_command("box", Vec3(1, 0, 0), Vec3(0, 0.7, 0));
  return scripted;
}

TEST_P(Transports, CreateListDelete) {
  start();
  const WorldId a = create(), b = create();
  const auto list = client_->list_worlds();
  ASSERT_TRUE(list);
  ASSERT_EQ(list->size(), 2u);
  EXPECT_EQ((*list)[0].id, a);
  EXPECT_EQ((*list)[0].name, "small");
  EXPECT_EQ((*list)[0].state, WorldState::paused);
  EXPECT_EQ((*list)[0].bodies, 3);
  ASSERT_TRUE(client_->delete_world(a));
  EXPECT_EQ(client_->delete_world(a).error().code, ErrorCode::not_found);
  EXPECT_EQ(client_->list_worlds()->at(0).id, b);
}

TEST_P(Transports, StepsInLockstepToTheStateOfALocalWorld) {
  start();
  const WorldId world = create();
  const auto scene = scene_convert::to_scene(test::small_scene(), scene_convert::NoFiles());
  ASSERT_TRUE(scene);
  const auto local = *sim::World::create(*scene);
  ASSERT_TRUE(client_->apply(world, impulse_command("cube", Vec3(200, 100, 0), Vec3(3, 1, 0))));
  ASSERT_TRUE(local->submit(sim::ApplyImpulse{local->find("cube"), Vec3(200, 100, 0), Vec3(3, 1, 0)}));
  for (const std::uint32_t steps : {1u, 7u, 52u}) {
    const auto summary = client_->step(world, steps, /*state_hash=*/true);
    ASSERT_TRUE(summary) << summary.error().text();
    for (std::uint32_t i = 0; i < steps; ++i) local->step();
    EXPECT_EQ(summary->state_hash, local->state_hash());
    EXPECT_EQ(summary->step, local->step_count());
  }
  EXPECT_EQ(hash(world), local->state_hash());
}

TEST_P(Transports, PushChangesTheStateFromTheNextStepOn) {
  start();
  const WorldId pushed = create(), left_alone = create();
  const auto acts = client_->apply(pushed, impulse_command("box", Vec3(500, 0, 0), Vec3(0, 0.7, 0)));
  ASSERT_TRUE(acts) << acts.error().text();
  EXPECT_EQ(*acts, 1u);
  EXPECT_NE(client_->step(pushed, 5, true)->state_hash, client_->step(left_alone, 5, true)->state_hash);
  const auto info = client_->world(pushed, true);
  EXPECT_NEAR(info->bodies.at(1).velocity.x(), 0.5, 0.1);  // 500 N s on 1000 kg, some of it lost to the ground
}

TEST_P(Transports, ForcesActForTheirDuration) {
  start();
  const WorldId world = create();
  ASSERT_TRUE(client_->apply(world, force_command("box", Vec3(0, 20000, 0), Vec3(0, 0.7, 0), 0.1)));
  ASSERT_TRUE(client_->step(world, 12));
  // 0.1 s at 20 - 9.81 m/s^2 upwards.
  EXPECT_NEAR(client_->world(world, true)->bodies.at(1).velocity.y(), 1.02, 0.02);
}

TEST_P(Transports, BadInputNamesItsFieldAndTouchesNothing) {
  start();
  const WorldId other = create();
  const auto untouched = client_->step(create(), 20, true)->state_hash;  // what the other will be
  const WorldId world = create();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto field = [](const auto& result) { return result ? "no error" : result.error().field; };
  const auto apply = [&](const v1::Command& command) { return client_->apply(world, command); };
  const std::uint64_t before = hash(world);

  EXPECT_EQ(field(apply(impulse_command("box", Vec3(nan, 0, 0), Vec3::Zero()))), "command.apply_impulse.impulse.x");
  EXPECT_EQ(field(apply(impulse_command("box", Vec3(2e9, 0, 0), Vec3::Zero()))), "command.apply_impulse.impulse");
  EXPECT_EQ(field(apply(impulse_command("nobody", Vec3::Zero(), Vec3::Zero()))), "command.apply_impulse.body");
  EXPECT_EQ(field(apply(impulse_command("ground", Vec3::Zero(), Vec3::Zero()))), "command.apply_impulse.body");
  EXPECT_EQ(field(apply(force_command("box", Vec3::Zero(), Vec3::Zero(), -1))), "command.apply_force.duration");
  EXPECT_EQ(field(apply({})), "command");
  v1::Command nodes;
  nodes.mutable_apply_node_impulse()->set_body("cube");
  nodes.mutable_apply_node_impulse()->add_nodes(0);
  nodes.mutable_apply_node_impulse()->add_nodes(1000);
  EXPECT_EQ(field(apply(nodes)), "command.apply_node_impulse.nodes[1]");
  EXPECT_EQ(field(client_->run_script(world, {kick_at(0.1), kick_at(nan)})), "commands[1].time");
  v1::ScriptedCommand at_ground = kick_at(0);
  at_ground.mutable_command()->mutable_apply_impulse()->set_body("ground");
  EXPECT_EQ(field(client_->run_script(world, {kick_at(0.1), at_ground})), "commands[1].command.apply_impulse.body");
  EXPECT_EQ(field(client_->play(world, -1)), "speed");
  EXPECT_EQ(field(client_->step(world, 0)), "steps");

  EXPECT_EQ(hash(world), before);
  EXPECT_EQ(client_->step(world, 20, true)->state_hash, untouched);  // nothing of all that was kept for later
  EXPECT_EQ(client_->step(other, 20, true)->state_hash, untouched);
}

TEST_P(Transports, BadScenesCreateNothing) {
  start();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto error = [&](const std::function<void(v1::Scene&)>& spoil) {
    v1::Scene scene = test::small_scene();
    spoil(scene);
    const auto created = client_->create_world(scene);
    EXPECT_FALSE(created);
    return created ? Error() : created.error();
  };
  EXPECT_EQ(error([&](v1::Scene& s) { s.set_dt(nan); }).field, "scene.dt");
  EXPECT_EQ(error([&](v1::Scene& s) { s.mutable_bodies(1)->mutable_pose()->mutable_position()->set_y(nan); }).field,
            "scene.bodies[1].pose.position.y");
  const Error poisson = error([](v1::Scene& s) { s.mutable_bodies(2)->mutable_fem()->mutable_material()->set_poisson_ratio(0.5); });
  EXPECT_EQ(poisson.field, "scene.bodies[2].fem.material.poisson_ratio");
  EXPECT_EQ(poisson.code, ErrorCode::invalid_argument);
  const Error file = error([](v1::Scene& s) { s.mutable_bodies(2)->mutable_fem()->mutable_mesh()->set_file("/etc/passwd"); });
  EXPECT_EQ(file.code, ErrorCode::invalid_argument);
  EXPECT_EQ(file.field, "scene.bodies[2].fem.mesh.file");
  EXPECT_EQ(client_->create_world_from_file("nothing").error().code, ErrorCode::not_found);
  EXPECT_EQ(client_->create_world(test::small_scene(), std::string(300, 'x')).error().field, "name");
  EXPECT_TRUE(client_->list_worlds()->empty());
}

TEST_P(Transports, UnknownWorldsAreNotFound) {
  start();
  const auto code = [](const auto& result) { return result ? ErrorCode::internal : result.error().code; };
  EXPECT_EQ(code(client_->world(9)), ErrorCode::not_found);
  EXPECT_EQ(code(client_->play(9)), ErrorCode::not_found);
  EXPECT_EQ(code(client_->pause(9)), ErrorCode::not_found);
  EXPECT_EQ(code(client_->step(9, 1)), ErrorCode::not_found);
  EXPECT_EQ(code(client_->apply(9, kick_at(0).command())), ErrorCode::not_found);
  EXPECT_EQ(code(client_->run_script(9, {})), ErrorCode::not_found);
  const auto stream = client_->watch(9);
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::not_found);
  EXPECT_EQ(stream.error().field, "subscribe.world");
}

TEST_P(Transports, AWatcherOfAPausedWorldSeesItAtOnceAndThenEachNewestStep) {
  start();
  const WorldId world = create();
  const auto stream = client_->watch(world);
  ASSERT_TRUE(stream) << stream.error().text();
  const auto topology = next_of<Topology>(**stream);
  ASSERT_TRUE(topology);
  EXPECT_EQ(topology->bodies.at(2).name, "cube");
  EXPECT_EQ(topology->bodies.at(2).model, BodyModel::fem);
  const auto first = next_of<Frame>(**stream);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->step, 0u);
  EXPECT_EQ(first->bodies.at(2).positions.size(), topology->bodies[2].vertices.size());
  ASSERT_TRUE(client_->step(world, 30));
  const auto second = next_of<Frame>(**stream);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->step, 30u);
  EXPECT_NEAR(second->time, 30.0 / 120, 1e-9);
  EXPECT_LT(second->bodies.at(1).pose.p_WB.y(), 0.7);
}

TEST_P(Transports, ASlowWatcherSkipsToTheNewestFrameAndLosesNoEvent) {
  start();
  const WorldId world = create();
  const auto stream = *client_->watch(world);
  ASSERT_EQ(next_of<Frame>(*stream)->step, 0u);
  std::vector<v1::ScriptedCommand> script;
  for (int i = 0; i < 200; ++i) script.push_back(kick_at(i / 120.0));
  ASSERT_TRUE(client_->run_script(world, script));
  for (int i = 0; i < 25; ++i) ASSERT_TRUE(client_->step(world, 10));  // while nobody reads

  std::vector<std::uint64_t> events, frames;
  while (frames.empty() || frames.back() < 250) {
    const auto update = stream->next(test::kDeadline);
    ASSERT_TRUE(update && *update);
    if (const auto* event = std::get_if<WorldEvent>(&**update)) {
      events.push_back(event->sequence);
      EXPECT_TRUE(frames.empty() || event->step >= frames.back());
    }
    if (const auto* frame = std::get_if<Frame>(&**update)) frames.push_back(frame->step);
  }
  EXPECT_LE(frames.size(), 2u);  // one that was on its way at most, then the newest
  ASSERT_GE(events.size(), 200u);
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_EQ(events[i], i + 1);
}

TEST_P(Transports, AWatcherBehindTheEventLogIsTold) {
  runtime::RegistryOptions options;
  options.runner.event_capacity = 20;
  start(options);
  const WorldId world = create();
  std::vector<v1::ScriptedCommand> script;
  for (int i = 0; i < 100; ++i) script.push_back(kick_at(0));
  ASSERT_TRUE(client_->run_script(world, script));
  ASSERT_TRUE(client_->step(world, 1));
  const auto stream = *client_->watch(world, {.after_event = 0});
  const auto gap = next_of<EventGap>(*stream);
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->first, 1u);
  const auto event = next_of<WorldEvent>(*stream);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->sequence, gap->last + 1);
  EXPECT_TRUE(next_of<Topology>(*stream));
}

// Two brittle bars that are torn apart, one after the other.
v1::Scene tearing_scene() {
  v1::Scene scene;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(R"(
      bodies { name: "ground" rigid { kind: FIXED shapes { plane { normal { y: 1 } } } } }
      bodies { name: "first" pose { position { y: 2 } }
               fem { mesh { box { size { x: 0.6 y: 0.1 z: 0.1 } cells { x: 6 y: 1 z: 1 } } } material { young: 1e6 breakable: true toughness: 1e4 }
                     motions { nodes { face: "x_min" } }
                     motions { nodes { face: "x_max" } keys { time: 0 } keys { time: 0.1 pose { position { x: 0.3 } } } } } }
      bodies { name: "second" pose { position { y: 3 } }
               fem { mesh { box { size { x: 0.6 y: 0.1 z: 0.1 } cells { x: 6 y: 1 z: 1 } } } material { young: 1e6 breakable: true toughness: 1e4 }
                     motions { nodes { face: "x_min" } }
                     motions { nodes { face: "x_max" } keys { time: 0 } keys { time: 0.2 } keys { time: 0.3 pose { position { x: 0.3 } } } } } })",
                                                            &scene));
  return scene;
}

TEST_P(Transports, AWatcherOfAWorldThatBreaksHasItsTopologyWhateverItSkips) {
  start();
  const auto created = client_->create_world(tearing_scene());
  ASSERT_TRUE(created) << created.error().text();
  const auto local = *sim::World::create(*scene_convert::to_scene(tearing_scene(), scene_convert::NoFiles()));
  const auto stream = *client_->watch(*created, {.codec = Codec::float32});
  Topology drawn;
  int topologies = 0;
  for (const std::uint32_t steps : {1u, 1u, 3u, 5u, 1u, 1u, 8u, 1u, 1u, 1u, 10u, 1u, 1u, 20u}) {
    ASSERT_TRUE(client_->step(*created, steps));
    for (std::uint32_t k = 0; k < steps; ++k) local->step();
    std::optional<Frame> frame;
    while (!frame || frame->step < local->step_count()) {
      const auto update = stream->next(test::kDeadline);
      ASSERT_TRUE(update && *update);
      if (const auto* topology = std::get_if<Topology>(&**update)) {
        ASSERT_EQ(topology->bodies.size(), 3u);  // whole, whatever was sent
        drawn = *topology;
        ++topologies;
      }
      if (const auto* now = std::get_if<Frame>(&**update)) frame = *now;
    }
    EXPECT_EQ(drawn.epoch, local->topology().epoch);
    EXPECT_EQ(frame->epoch, drawn.epoch);
    const Frame here = local->capture();
    for (BodyId b = 1; b < 3; ++b) {
      EXPECT_EQ(drawn.bodies[b].epoch, local->topology().bodies[b].epoch);
      EXPECT_EQ(drawn.bodies[b].triangles, local->topology().bodies[b].triangles);
      EXPECT_EQ(frame->bodies[b].positions, here.bodies[b].positions);
    }
  }
  EXPECT_LT(drawn.bodies[1].epoch, drawn.bodies[2].epoch) << "both bars must break, one after the other";
  EXPECT_GT(drawn.bodies[1].epoch, 0u);
  EXPECT_GT(topologies, 2);
}

TEST_P(Transports, APlayingWorldStreamsAndTellsItsFactor) {
  start();
  const WorldId world = create();
  const auto stream = *client_->watch(world, {.codec = Codec::float32, .compress = false, .values = true});
  ASSERT_TRUE(client_->play(world));
  std::uint64_t last = 0;
  for (int i = 0; i < 10; ++i) {
    const auto frame = next_of<Frame>(*stream);
    ASSERT_TRUE(frame);
    EXPECT_TRUE(i == 0 || frame->step > last);
    last = frame->step;
    EXPECT_EQ(frame->bodies.at(2).values.size(), frame->bodies[2].positions.size());
  }
  EXPECT_GT(client_->world(world)->status.real_time_factor, 0);
  EXPECT_EQ(client_->world(world)->status.viewers, 1);
  EXPECT_EQ(client_->world(world)->status.state, WorldState::playing);
  EXPECT_EQ(client_->step(world, 1).error().code, ErrorCode::failed_precondition);
  EXPECT_GE(*client_->pause(world), last);
}

TEST_P(Transports, DeletingAWorldEndsItsStreamsWithTheReason) {
  start();
  const WorldId world = create();
  const auto stream = *client_->watch(world);
  ASSERT_TRUE(next_of<Frame>(*stream));
  ASSERT_TRUE(client_->delete_world(world));
  const auto end = stream->next(test::kDeadline);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::not_found);
  EXPECT_EQ(end.error().message, "world 1 was deleted");
  EXPECT_EQ(stream->next(test::kDeadline).error().message, "world 1 was deleted");
}

TEST_P(Transports, AClosedStreamEndsItsWaitingReader) {
  start();
  const WorldId world = create();
  std::promise<Update> first;
  auto subscription = std::make_unique<Subscription>(
      *client_->watch(world), [&, sent = false](const Update& update) mutable {
        if (!std::exchange(sent, true)) first.set_value(update);
      }, nullptr);
  EXPECT_TRUE(std::holds_alternative<Topology>(first.get_future().get()));
  subscription.reset();  // while its thread waits for the next step
}

TEST_P(Transports, TwoClientsSeeTheSame) {
  start();
  const WorldId world = create();
  const auto a = *client_->watch(world, {.codec = Codec::float32}), b = *client_->watch(world, {.codec = Codec::float32});
  ASSERT_EQ(client_->world(world)->status.viewers, 2);
  ASSERT_TRUE(next_of<Frame>(*a) && next_of<Frame>(*b));
  ASSERT_TRUE(client_->step(world, 10));
  const auto of_a = next_of<Frame>(*a), of_b = next_of<Frame>(*b);
  ASSERT_TRUE(of_a && of_b);
  EXPECT_EQ(of_a->step, of_b->step);
  EXPECT_EQ(of_a->bodies.at(2).positions, of_b->bodies.at(2).positions);
}

}  // namespace
}  // namespace crumple::client
