#pragma once

#include <functional>

namespace crumple::sim {

// The only place that knows about threads. Work is cut into chunks of fixed size, so that which items share a chunk,
// and with it every rounding, does not depend on the number of threads.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);  // >= 1; 1 runs everything on the calling thread
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const;
  // Calls body(begin, end) for consecutive ranges of at most `chunk` items that cover [0, count).
  // body must only write what belongs to its range. Ranges are begun in ascending order. body may call for_chunks itself:
  // while it waits it begins no other range of the outer call, and threads that have none left of that help it.
  void for_chunks(int count, int chunk, const std::function<void(int begin, int end)>& body) const;
  // Whether `holds` of any of these ranges; ranges after one that does may not be asked.
  bool any_chunk(int count, int chunk, const std::function<bool(int begin, int end)>& holds) const;

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace crumple::sim
