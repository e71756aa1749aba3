#include "server/sim/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

namespace crumple::sim {
namespace {

TEST(ThreadPool, EveryRangeIsDoneOnceAlsoInsideOfOthers) {
  for (const int threads : {1, 2, 5}) {
    const ThreadPool pool(threads);
    for (const int count : {0, 1, 7, 100}) {
      std::vector<std::vector<int>> done(count, std::vector<int>(53, 0));
      pool.for_chunks(count, 3, [&](int begin, int end) {
        EXPECT_LE(end - begin, 3);
        for (int i = begin; i < end; ++i)
          pool.for_chunks(53, 10, [&](int first, int last) {
            for (int j = first; j < last; ++j) ++done[i][j];
          });
      });
      for (const auto& row : done) EXPECT_EQ(std::ranges::count(row, 1), 53) << threads;
    }
  }
}

TEST(ThreadPool, OneThreadTakesRangesInOrder) {
  const ThreadPool pool(1);
  std::vector<int> order;
  pool.for_chunks(10, 1, [&](int begin, int) { order.push_back(begin); });
  EXPECT_TRUE(std::ranges::is_sorted(order));
}

TEST(ThreadPool, WhatARangeThrowsReachesTheCallerAndThePoolGoesOn) {
  const ThreadPool pool(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<int> done(64, 0);
    const auto body = [&](int begin, int) {
      if (begin % 16 == 5) throw std::runtime_error("range");
      done[begin] = 1;
    };
    EXPECT_THROW(pool.for_chunks(64, 1, body), std::runtime_error);
    EXPECT_EQ(std::ranges::count(done, 1), 60);
    const auto thrower = [](int begin, int) {
      if (begin == 5) throw std::runtime_error("range");
    };
    EXPECT_THROW(pool.for_jobs(8, [&](int) { pool.for_chunks(64, 1, thrower); }), std::runtime_error);
  }
}

TEST(ThreadPool, ThreadsThatShareItWaitForTheirOwnRangesAlone) {
  const ThreadPool pool(3);
  std::vector<std::jthread> callers;
  std::vector<int> rounds(4, 0);
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&, caller] {
      for (int round = 0; round < 300; ++round) {
        std::vector<int> done(200, 0);
        pool.for_chunks(200, 7, [&](int begin, int end) {
          pool.for_chunks(end - begin, 2, [&](int first, int last) {
            pool.for_chunks(last - first, 1, [&](int k, int) { ++done[begin + first + k]; });  // deeper than the pool goes
          });
        });
        rounds[caller] += std::ranges::count(done, 1) == 200;
      }
    });
  }
  callers.clear();
  EXPECT_EQ(rounds, std::vector<int>(4, 300));
}

TEST(ThreadPool, MoreRangesThanAShareHoldsAreAllDone) {
  const ThreadPool pool(2);
  std::vector<char> done(200'000, 0);
  pool.for_chunks(200'000, 1, [&](int begin, int) { ++done[begin]; });
  EXPECT_EQ(std::ranges::count(done, 1), 200'000);
}

TEST(ThreadPool, WakesAfterIdleTime) {
  const ThreadPool pool(4);
  for (int round = 0; round < 20; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // longer than threads stay awake
    std::atomic<int> begun = 0;
    // The first job waits for a second: for ever, were they done by one thread alone.
    pool.for_jobs(4, [&](int) {
      ++begun;
      while (begun < 2) std::this_thread::yield();
    });
    EXPECT_EQ(begun, 4);
  }
}

TEST(ThreadPool, ACallerThatHasNoRangeLeftHelpsInsideOfOthers) {
  const ThreadPool pool(2);
  const std::thread::id caller = std::this_thread::get_id();
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> jobs = 0, ranges = 0;
    pool.for_jobs(2, [&](int) {
      ++jobs;
      while (jobs < 2) std::this_thread::yield();  // so that each thread has one
      if (std::this_thread::get_id() == caller) return;
      pool.for_chunks(2, 1, [&](int, int) {
        ++ranges;
        while (ranges < 2) std::this_thread::yield();
      });
    });
    EXPECT_EQ(ranges, 2);
  }
}

TEST(ThreadPool, AFewJobsWithLoopsInsideFinishWhateverTheirSizes) {
  const ThreadPool pool(4);
  std::vector<double> sums(6, 0);
  for (int round = 0; round < 200; ++round) {
    std::ranges::fill(sums, 0.0);
    pool.for_jobs(6, [&](int job) {
      std::vector<double> partial(1 << (2 * job), 0);
      pool.for_chunks(static_cast<int>(partial.size()), 1, [&](int begin, int) { partial[begin] = 1; });
      sums[job] = std::accumulate(partial.begin(), partial.end(), 0.0);
    });
    for (int job = 0; job < 6; ++job) ASSERT_EQ(sums[job], 1 << (2 * job));
  }
}

TEST(ThreadPool, CountsOverAllRangesWhateverTheThreads) {
  for (const int threads : {1, 3}) {
    const ThreadPool pool(threads);
    EXPECT_EQ(pool.count_chunks(1000, 7, [](int begin, int end) { return end - begin; }), 1000);
    EXPECT_EQ(pool.count_chunks(0, 7, [](int, int) { return 1; }), 0);
  }
}

}  // namespace
}  // namespace crumple::sim
