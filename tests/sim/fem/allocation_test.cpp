#include "server/sim/fem/bdf2.h"
#include "tests/sim/fem/fem_test_support.h"

#include <atomic>
#include <cstdlib>
#include <new>

// Counts what a step allocates: malloc of our own objects (Eigen's way; the linker wraps it) and operator new.
namespace {
std::atomic<bool> counting{false};
std::atomic<int> allocations{0};
void count() {
  if (counting) ++allocations;
}
}  // namespace

extern "C" void* __real_malloc(std::size_t size);
extern "C" void* __wrap_malloc(std::size_t size) {
  count();
  return __real_malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  count();
  if (void* p = __real_malloc(size ? size : 1)) return p;
  std::abort();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  count();
  const std::size_t a = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a)) return p;
  std::abort();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace crumple::sim::fem {
namespace {

TEST(Allocation, AStepAllocatesNothingAfterTheFirst) {
  const TetMesh mesh = test::kuhn_box(12, 5, 5, {1, 0.3, 0.3});
  FemMaterial material;
  material.yield = 0.01;
  material.creep = 0.2;
  const RestBody rest = test::rest_body(mesh, material);
  FemState state = test::rest_state(mesh);
  test::Random random;
  for (Vec3& x : state.x) x += random.vec3(-0.05, 0.05);  // inverts some
  ASSERT_GT(inverted_count(mesh.tets, state.x), 0);
  const Eigen::VectorXd f = test::gravity_force(rest, {0, -9.81, 0});
  const std::vector<PrescribedNode> held{{0, Vec3::Zero()}, {1, Vec3::Zero()}};
  const StepOptions options = step_options(material, 1.0 / 60);
  for (bool float_matrix : {false, true}) {
    StepScratch scratch(float_matrix);
    const ThreadPool pool(1);  // the threads' library allocates its own tasks
    allocations = 0;
    counting = true;
    implicit_euler_step(rest, mesh.tets, state, f, held, options, pool, scratch);
    counting = false;
    EXPECT_GT(allocations, 10);  // the counter counts
    allocations = 0;
    counting = true;
    for (int k = 0; k < 3; ++k) implicit_euler_step(rest, mesh.tets, state, f, held, options, pool, scratch);
    counting = false;
    EXPECT_EQ(allocations, 0);
  }
}

TEST(Allocation, NorDoesAStepOfBdf2AfterTheSecond) {
  const TetMesh mesh = test::kuhn_box(12, 5, 5, {1, 0.3, 0.3});
  const RestBody rest = test::rest_body(mesh, {});
  FemState state = test::rest_state(mesh);
  const Eigen::VectorXd f = test::gravity_force(rest, {0, -9.81, 0});
  const std::vector<PrescribedNode> held{{0, Vec3::Zero()}, {1, Vec3::Zero()}};
  StepScratch scratch;
  Bdf2Scratch bdf2;
  const ThreadPool pool(1);
  const auto steps = [&](int count) {
    allocations = 0;
    counting = true;
    for (int k = 0; k < count; ++k) {
      bdf2_step(rest, mesh.tets, state, f, held, step_options(rest.material, 1.0 / 60), pool, scratch, bdf2);
    }
    counting = false;
  };
  steps(2);
  EXPECT_GT(allocations, 10);
  ASSERT_TRUE(remembers(state));
  steps(3);
  EXPECT_EQ(allocations, 0);
  restart(state);
  steps(4);
  ASSERT_TRUE(remembers(state));
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace crumple::sim::fem
