// One scene, every way to step it: the same bits.
#include "client/sdk/in_process_client.h"
#include "server/worker/job.h"
#include "tests/integration/scene_run.h"
#include "tests/support/running_server.h"
#include "tests/support/temporary_folder.h"

namespace crumple {
namespace {

constexpr int kSteps = 140;  // the car has dented barrels and broken glass by then

std::uint64_t hash_of_world(const sim::SceneDescription& scene, int threads) {
  const auto world = *sim::World::create(scene, {.threads = threads});
  bool dented = false, broken = false;
  for (int k = 0; k < kSteps; ++k) world->step();
  for (const sim::Event& event : world->take_events()) {
    dented = dented || event.kind == sim::EventKind::dent;
    broken = broken || event.kind == sim::EventKind::fracture;
  }
  EXPECT_TRUE(dented && broken) << "equal hashes would say little";
  return world->state_hash();
}

std::uint64_t hash_of_client(client::SimulationClient& client, const v1::Scene& scene) {
  const auto world = client.create_world(scene);
  EXPECT_TRUE(world) << world.error().text();
  if (!world) return 0;
  EXPECT_TRUE(client.step(*world, kSteps / 2));
  const auto summary = client.step(*world, kSteps - kSteps / 2, /*state_hash=*/true);
  EXPECT_TRUE(summary) << summary.error().text();
  return summary ? summary->state_hash : 0;
}

TEST(SameBits, OneAndTwoThreadsInProcessOverGrpcAndInABatchJob) {
  const v1::Scene message = test::shipped_scene("crash");
  const auto scene = scene_convert::to_scene(message, scene_convert::NoFiles());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::uint64_t hash = hash_of_world(*scene, 1);
  EXPECT_EQ(hash_of_world(*scene, 2), hash);

  runtime::WorldRegistry registry;
  EXPECT_EQ(hash_of_client(*client::in_process(registry), message), hash);
  const auto server = test::start_server();
  EXPECT_EQ(hash_of_client(*test::connect_to(*server), message), hash);

  const test::TemporaryFolder folder;
  worker::Job job{.scene = *scene, .steps = kSteps, .threads = 2, .out = folder.path() / "out"};
  job.recording.every = kSteps;
  const auto report = worker::run_job(job, [](int) {});
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_EQ(report->state_hash, hash);
}

}  // namespace
}  // namespace crumple
