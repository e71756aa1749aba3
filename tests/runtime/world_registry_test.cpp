#include "server/runtime/world_registry.h"

#include <gtest/gtest.h>

#include "tests/runtime/awaited.h"
#include "tests/runtime/small_scene.h"

namespace crumple::runtime {
namespace {

using test::await;

Result<WorldId> create(WorldRegistry& registry, const std::string& name = "") {
  return await<WorldId>([&](auto done) { registry.create(name, [] { return test::falling_box(); }, done); });
}

TEST(WorldRegistry, CreatesListsAndRemovesById) {
  WorldRegistry registry;
  EXPECT_EQ(*create(registry), 1u);
  EXPECT_EQ(*create(registry, "second"), 2u);
  const auto list = registry.list();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].name, "falling box");
  EXPECT_EQ(list[1].name, "second");
  EXPECT_EQ(list[1].bodies, 2);
  ASSERT_TRUE(registry.remove(1));
  EXPECT_EQ(registry.find(1).error().code, ErrorCode::not_found);
  EXPECT_EQ(registry.remove(1).error().field, "world");
  EXPECT_EQ(*create(registry), 3u);  // no id twice
}

TEST(WorldRegistry, HoldsNoMoreThanItMay) {
  WorldRegistry registry({.max_worlds = 2});
  ASSERT_TRUE(create(registry) && create(registry));
  EXPECT_EQ(create(registry).error().code, ErrorCode::resource_exhausted);
  ASSERT_TRUE(registry.remove(2));
  EXPECT_TRUE(create(registry));
}

TEST(WorldRegistry, ABadSceneLeavesNothing) {
  WorldRegistry registry({.max_worlds = 1});
  const auto bad = await<WorldId>([&](auto done) {
    registry.create("", [] {
      auto scene = test::falling_box();
      scene.dt = std::nan("");
      return scene;
    }, done);
  });
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(bad.error().field, "dt");
  EXPECT_TRUE(registry.list().empty());
  EXPECT_TRUE(create(registry));  // its place is free
}

TEST(WorldRegistry, RemovingEndsReadersAndCallers) {
  WorldRegistry registry;
  const WorldId id = *create(registry);
  auto runner = *registry.find(id);
  test::BellReader reader(runner->hub(), {});
  test::Pending<StepSummary> stepped;
  runner->step(WorldRunner::kMaxSteps, false, stepped.done());
  runner.reset();
  ASSERT_TRUE(registry.remove(id));
  EXPECT_EQ(reader.next_of<Closed>()->reason.code, ErrorCode::not_found);
  EXPECT_EQ(stepped.get().error().code, ErrorCode::not_found);
}

TEST(WorldRegistry, ClosedRefusesNewWorlds) {
  WorldRegistry registry;
  const WorldId id = *create(registry);
  test::BellReader reader((*registry.find(id))->hub(), {});
  registry.close({ErrorCode::unavailable, "", "stopping"});
  EXPECT_EQ(reader.next_of<Closed>()->reason.code, ErrorCode::unavailable);
  EXPECT_EQ(create(registry).error().code, ErrorCode::unavailable);
}

}  // namespace
}  // namespace crumple::runtime
