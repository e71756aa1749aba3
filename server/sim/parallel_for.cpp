#include "server/sim/parallel_for.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <functional>

namespace crumple::sim {

struct ThreadPool::Impl {
  int threads;
  tbb::task_arena arena;
};

ThreadPool::ThreadPool(int threads) : impl_(new Impl{threads, tbb::task_arena(threads)}) { assert(threads >= 1); }
ThreadPool::~ThreadPool() { delete impl_; }
int ThreadPool::threads() const { return impl_->threads; }

void ThreadPool::for_chunks(int count, int chunk, const std::function<void(int, int)>& body) const {
  assert(chunk > 0);
  const int chunks = (count + chunk - 1) / chunk;
  const auto run = [&](int c) { body(c * chunk, std::min(count, (c + 1) * chunk)); };
  if (impl_->threads == 1 || chunks <= 1) {
    for (int c = 0; c < chunks; ++c) run(c);
    return;
  }
  // A free thread takes the next chunk: what is to start first comes first. While it waits for passes inside of a chunk it does
  // no other chunk, whose end these would then wait for; but threads with no chunk left help with such passes.
  std::atomic<int> next = 0;
  const auto work = [&](int) {
    for (int c = next++; c < chunks; c = next++) tbb::this_task_arena::isolate([&] { run(c); });
  };
  impl_->arena.execute([&] { tbb::parallel_for(0, std::min(impl_->threads, chunks), work, tbb::simple_partitioner()); });
}

bool ThreadPool::any_chunk(int count, int chunk, const std::function<bool(int, int)>& holds) const {
  std::atomic<bool> found = false;
  const auto look = [&](int begin, int end) {
    if (!found.load(std::memory_order_relaxed) && holds(begin, end)) found = true;
  };
  for_chunks(count, chunk, std::cref(look));
  return found;
}

}  // namespace crumple::sim
