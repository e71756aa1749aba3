#include "server/sim/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
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

TEST(ThreadPool, AFewJobsWithLoopsInsideFinishWhateverTheirSizes) {
  const ThreadPool pool(4);
  std::vector<double> sums(6, 0);
  for (int round = 0; round < 200; ++round) {
    std::ranges::fill(sums, 0.0);
    pool.for_chunks(6, 1, [&](int job, int) {
      std::vector<double> partial(1 << (2 * job), 0);
      pool.for_chunks(static_cast<int>(partial.size()), 1, [&](int begin, int) { partial[begin] = 1; });
      sums[job] = std::accumulate(partial.begin(), partial.end(), 0.0);
    });
    for (int job = 0; job < 6; ++job) ASSERT_EQ(sums[job], 1 << (2 * job));
  }
}

}  // namespace
}  // namespace crumple::sim
