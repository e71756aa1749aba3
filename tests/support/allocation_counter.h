#pragma once

#include <atomic>
#include <cstdlib>
#include <new>

// Include in one source file of a program, and link it with -Wl,--wrap=malloc.
// What is allocated: malloc of our own objects (Eigen's way; the linker wraps it) and operator new.
namespace crumple::test {
inline std::atomic<bool> counting{false};
inline std::atomic<int> allocations{0};
inline void count_allocation() {
  if (counting) ++allocations;
}
// Of what runs on all threads meanwhile.
template <class Work>
int count_allocations(Work&& work) {
  allocations = 0;
  counting = true;
  work();
  counting = false;
  return allocations;
}
}  // namespace crumple::test

extern "C" void* __real_malloc(std::size_t size);
extern "C" void* __wrap_malloc(std::size_t size) {
  crumple::test::count_allocation();
  return __real_malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  crumple::test::count_allocation();
  if (void* p = __real_malloc(size ? size : 1)) return p;
  std::abort();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // of sorts' temporary buffers
  crumple::test::count_allocation();
  return __real_malloc(size ? size : 1);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  crumple::test::count_allocation();
  const std::size_t a = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a)) return p;
  std::abort();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

