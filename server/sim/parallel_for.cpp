#include "server/sim/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstdint>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

namespace crumple::sim {
namespace {

// Looks of a thread that has nothing to do, each some 50 ns, before it gives way; and how often it does that before it sleeps.
constexpr int kLooks = 200;
constexpr int kYields = 300;

constexpr std::size_t kCacheLine = 64;

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// Chunks [next, end) of which loop, in one word: whoever takes one knows that this loop is still open.
struct alignas(kCacheLine) Share {
  static constexpr int kMost = 0xffff;
  static std::uint64_t pack(std::uint32_t loop, int next, int end) {
    return std::uint64_t{loop} << 32 | static_cast<std::uint64_t>(next) << 16 | static_cast<std::uint64_t>(end);
  }
  // The next chunk of this loop; -1: none left.
  int take(std::uint32_t loop) {
    std::uint64_t now = word.load(std::memory_order_acquire);
    while (now >> 32 == loop && (now >> 16 & kMost) < (now & kMost)) {
      if (word.compare_exchange_weak(now, now + (1 << 16), std::memory_order_acq_rel, std::memory_order_acquire)) return now >> 16 & kMost;
    }
    return -1;
  }
  std::atomic<std::uint64_t> word = 0;
};

// A place for one loop after the other; who opens one owns it until it is done. What is not atomic is read by those who have taken
// a chunk, for whom the owner waits.
struct Loop {
  explicit Loop(int threads) : shares(threads) {}

  alignas(kCacheLine) std::atomic<std::uint32_t> open = 0;  // number of the last loop begun here
  alignas(kCacheLine) std::atomic<int> done = 0;            // chunks
  std::atomic<bool> failed = false;
  std::exception_ptr failure;
  const std::function<void(int)>* run = nullptr;
  std::vector<Share> shares;  // one a thread
};

// Where a thread is: in a chunk of an outermost loop (depth 1), or of one inside (2).
struct Place {
  const void* team = nullptr;
  int thread = 0;  // 0: that of the outermost caller
  int depth = 0;
};
thread_local Place place;

}  // namespace

class ThreadPool::Team {
 public:
  explicit Team(int threads) : outer_(threads), looks_(threads <= static_cast<int>(std::thread::hardware_concurrency()) ? kLooks : 0) {
    for (int t = 0; t < threads; ++t) inner_.push_back(std::make_unique<Loop>(threads));
    seen_by_caller_.assign(threads, 0);
    for (int t = 1; t < threads; ++t) {
      workers_.emplace_back([this, t, seen = std::vector<std::uint32_t>(threads, 0)]() mutable { help(t, seen); });
    }
  }
  ~Team() {
    stopping_ = true;
    wake_all();
    for (std::thread& worker : workers_) worker.join();
  }
  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  // Each thread has a part of the chunks to begin with; or all take from one.
  void run(int chunks, bool in_order, const std::function<void(int)>& body) {
    const Place here = place.team == this ? place : Place{this, 0, 0};
    if (chunks <= 1 || here.depth == 2 || (here.depth == 0 && busy_.exchange(true, std::memory_order_acquire))) {
      for (int c = 0; c < chunks; ++c) body(c);
      return;
    }
    const struct Release {
      std::atomic<bool>* busy;
      ~Release() { if (busy) busy->store(false, std::memory_order_release); }
    } release{here.depth == 0 ? &busy_ : nullptr};
    Loop& loop = here.depth == 0 ? outer_ : *inner_[here.thread];
    for (int first = 0; first < chunks; first += Share::kMost) {
      const std::function<void(int)> shifted = [&](int c) { body(first + c); };
      run_in(loop, here, std::min(chunks - first, Share::kMost), in_order, first == 0 ? body : shifted);
    }
  }

 private:
  void run_in(Loop& loop, const Place& here, int chunks, bool in_order, const std::function<void(int)>& body) {
    const std::uint32_t number = loop.open.load(std::memory_order_relaxed) + 1;
    loop.done.store(0, std::memory_order_relaxed);
    loop.run = &body;
    const int shares = in_order ? 1 : static_cast<int>(loop.shares.size());
    for (int s = 0; s < static_cast<int>(loop.shares.size()); ++s) {
      const int begin = std::min<std::int64_t>(chunks, std::int64_t{chunks} * s / shares);
      const int end = std::min<std::int64_t>(chunks, std::int64_t{chunks} * (s + 1) / shares);
      loop.shares[s].word.store(Share::pack(number, begin, end), std::memory_order_release);
    }
    loop.open.store(number);
    if (asleep_.load() > 0 && asleep_.exchange(0) > 0) wake_all();
    take_part(loop, number, here);
    for (int looks = 0; loop.done.load(std::memory_order_acquire) < chunks; ++looks) {
      if (here.depth == 0 && help_inner(0, seen_by_caller_)) looks = 0;
      else wait(looks);
    }
    if (!loop.failed.load(std::memory_order_relaxed)) return;
    loop.failed.store(false, std::memory_order_relaxed);
    std::rethrow_exception(std::exchange(loop.failure, nullptr));
  }

  // Takes chunks while there are any, its own first. Whether there were.
  bool take_part(Loop& loop, std::uint32_t number, const Place& here) {
    const int count = static_cast<int>(loop.shares.size());
    int done = 0;
    for (int k = 0; k < count; ++k) {
      Share& share = loop.shares[(here.thread + k) % count];
      for (int c = share.take(number); c >= 0; c = share.take(number), ++done) {
        const Place before = std::exchange(place, {this, here.thread, here.depth + 1});
        try {
          (*loop.run)(c);
        } catch (...) {
          if (!loop.failed.exchange(true)) loop.failure = std::current_exception();
        }
        place = before;
      }
    }
    if (done > 0) loop.done.fetch_add(done, std::memory_order_release);
    return done > 0;
  }

  bool help_with(Loop& loop, std::uint32_t& seen, const Place& here) {
    const std::uint32_t number = loop.open.load(std::memory_order_acquire);
    return number != std::exchange(seen, number) && take_part(loop, number, here);
  }

  // Of a thread that is in no chunk. seen: number of the last loop that it looked into, of each of inner_.
  bool help_inner(int thread, std::vector<std::uint32_t>& seen) {
    bool helped = false;
    for (std::size_t t = 0; t < inner_.size(); ++t) helped |= help_with(*inner_[t], seen[t], {this, thread, 1});
    return helped;
  }

  void help(int thread, std::vector<std::uint32_t>& seen) {
    std::uint32_t seen_outer = 0;
    for (int idle = 0; !stopping_.load(std::memory_order_relaxed); ++idle) {
      const bool helped = help_with(outer_, seen_outer, {this, thread, 0}) | help_inner(thread, seen);
      if (helped) idle = 0;
      if (idle < looks_ + kYields) {
        wait(idle);
        continue;
      }
      const std::uint32_t call = call_.load();
      ++asleep_;
      bool anything = stopping_ || outer_.open.load() != seen_outer;
      for (std::size_t t = 0; t < inner_.size(); ++t) anything |= inner_[t]->open.load() != seen[t];
      if (!anything) call_.wait(call);
      idle = 0;
    }
  }

  void wait(int looks) const {
    if (looks < looks_) pause();
    else std::this_thread::yield();
  }

  void wake_all() {
    ++call_;
    call_.notify_all();
  }

  Loop outer_;
  std::vector<std::unique_ptr<Loop>> inner_;  // one a thread
  std::vector<std::uint32_t> seen_by_caller_;  // of the outermost call
  int looks_;
  std::atomic<bool> busy_ = false;     // outer_ has an owner
  alignas(kCacheLine) std::atomic<bool> stopping_ = false;
  std::atomic<std::uint32_t> call_ = 0;
  std::atomic<int> asleep_ = 0;        // at most so many
  std::vector<std::thread> workers_;   // last: they use the others
};

ThreadPool::ThreadPool(int threads) {
  assert(threads >= 1);
  if (threads > 1) team_ = std::make_unique<Team>(threads);
}
ThreadPool::~ThreadPool() = default;
int ThreadPool::threads() const { return team_ ? team_->threads() : 1; }

void ThreadPool::for_chunks(int count, int chunk, const std::function<void(int, int)>& body) const {
  assert(chunk > 0);
  const int chunks = (count + chunk - 1) / chunk;
  const auto run = [&](int c) { body(c * chunk, std::min(count, (c + 1) * chunk)); };
  if (team_) return team_->run(chunks, false, std::cref(run));
  for (int c = 0; c < chunks; ++c) run(c);
}

void ThreadPool::for_jobs(int count, const std::function<void(int)>& body) const {
  if (team_) return team_->run(count, true, body);
  for (int i = 0; i < count; ++i) body(i);
}

bool ThreadPool::any_chunk(int count, int chunk, const std::function<bool(int, int)>& holds) const {
  std::atomic<bool> found = false;
  const auto look = [&](int begin, int end) {
    if (!found.load(std::memory_order_relaxed) && holds(begin, end)) found = true;
  };
  for_chunks(count, chunk, std::cref(look));
  return found;
}

int ThreadPool::count_chunks(int count, int chunk, const std::function<int(int, int)>& number) const {
  std::atomic<int> sum = 0;
  const auto add = [&](int begin, int end) { sum.fetch_add(number(begin, end), std::memory_order_relaxed); };
  for_chunks(count, chunk, std::cref(add));
  return sum;
}

}  // namespace crumple::sim
