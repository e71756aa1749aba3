#include "server/lab/roofline.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace crumple::lab {
namespace {

const Json* find(const Json& result, const std::string& loop, int threads) {
  for (const Json& one : result["loops"])
    if (one["loop"] == loop && one["threads"] == threads) return &one;
  return nullptr;
}

// A cube of six tets: 8 nodes, 12 edges, 6 diagonals of faces and one through the middle, so 38 off-diagonal blocks of 9 numbers and
// a column each, and a row of a node has a start, a diagonal block and two vectors.
TEST(Roofline, CountsTheBytesOfAProductOfACube) {
  const auto result = measure_roofline({.cells = {1, 1, 1}, .threads = {1}, .stream_mb = 1, .repeats = 3});
  ASSERT_TRUE(result) << result.error().text();
  EXPECT_EQ((*result)["tets"], 6);
  EXPECT_EQ((*find(*result, "matvec", 1))["bytes"], 38 * (9 * 8 + 4) + 8 * (4 + 72 + 48));
  EXPECT_EQ((*find(*result, "matvec_float", 1))["bytes"], 38 * (9 * 4 + 4) + 8 * (4 + 72 + 48));
}

TEST(Roofline, SharesAreOfTheTriadWithAsManyThreads) {
  const auto result = measure_roofline({.cells = {10, 2, 2}, .threads = {1, 2}, .stream_mb = 4, .repeats = 5});
  ASSERT_TRUE(result) << result.error().text();
  for (const int threads : {1, 2}) {
    const double roof = (*find(*result, "triad", threads))["gb_per_s"].get<double>();
    EXPECT_GT(roof, 0);
    for (const char* loop : {"matvec", "matvec_float", "assembly", "block_jacobi", "cg_vectors"}) {
      const Json& one = *find(*result, loop, threads);
      const double rate = one["bytes"].get<double>() / one["us"].get<double>() * 1e-3;
      EXPECT_NEAR(one["gb_per_s"].get<double>(), rate, 1e-9 * rate);
      EXPECT_NEAR(one["share"].get<double>(), rate / roof, 1e-9 * rate / roof) << loop;
    }
  }
  const std::string table = roofline_table(*result);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 2 + 12);
}

TEST(Roofline, RefusesWhatIsOutOfRange) {
  const auto refused = [](const RooflineOptions& options) { return measure_roofline(options).error().field; };
  EXPECT_EQ(refused({.cells = {0, 1, 1}}), "cells");
  EXPECT_EQ(refused({.threads = {}}), "threads");
  EXPECT_EQ(refused({.threads = {0}}), "threads");
  EXPECT_EQ(refused({.stream_mb = 0}), "stream_mb");
  EXPECT_EQ(refused({.repeats = 0}), "repeats");
}

}  // namespace
}  // namespace crumple::lab
