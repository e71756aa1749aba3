#pragma once

#include <functional>
#include <memory>

namespace crumple::sim {

// The only place that knows about threads. Work is cut into chunks of fixed size, so that which items share a chunk,
// and with it every rounding, does not depend on the number of threads.
//
// A solve is hundreds of loops of some microseconds each. Threads that have just helped stay awake for what comes next (first
// they watch, then they give way to others of the machine, after a fifth of a millisecond they sleep), and each begins with the
// same part of a range in every loop, which its cache has then. Solves took 5 to 20 % longer with a library's scheduler of tasks
// (docs/lab.md).
class ThreadPool {
 public:
  explicit ThreadPool(int threads);  // >= 1; 1 runs everything on the calling thread
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const;
  // Calls body(begin, end) for consecutive ranges of at most `chunk` items that cover [0, count). body must only write what
  // belongs to its range. What one of them throws is thrown here; whether the others are done then is open.
  // body may call these functions itself, two deep: while it waits it begins no other range of the outer call, and threads that
  // have none left of that help it, the outer caller among them. Deeper ones, and calls from a second thread at the same time, run on
  // the thread that calls. Scratch that belongs to a thread may be in use across a call of these only where the body of that call
  // calls none itself.
  void for_chunks(int count, int chunk, const std::function<void(int begin, int end)>& body) const;
  // Calls body(i) for i in [0, count), begun in ascending order whatever each costs: what is to start first comes first.
  void for_jobs(int count, const std::function<void(int i)>& body) const;
  // Whether `holds` of any of these ranges; once one does, others may not be asked.
  bool any_chunk(int count, int chunk, const std::function<bool(int begin, int end)>& holds) const;
  // Sum of what `number` says of these ranges: integers, which have no order.
  int count_chunks(int count, int chunk, const std::function<int(int begin, int end)>& number) const;

 private:
  class Team;
  std::unique_ptr<Team> team_;  // none of one thread
};

}  // namespace crumple::sim
