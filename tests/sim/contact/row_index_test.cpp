#include "server/sim/contact/row_index.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>
#include <vector>

namespace crumple::sim::contact {
namespace {

TEST(RowIndex, HasNothingBeforeAnythingIsAdded) {
  RowIndex index;
  EXPECT_EQ(index.find({0, 0, 0, 0}), -1);
  index.assign(std::vector<RowKey>{}, std::identity{});
  EXPECT_EQ(index.find({0, 0, 0, 0}), -1);
}

TEST(RowIndex, FindsWhatAMapFindsAndOfEqualKeysTheFirst) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> id(-1, 6);  // few: many keys come twice, and many share a slot
  RowIndex index;
  for (const int count : {1, 50, 900, 50}) {  // fewer after more: what was there is gone
    std::map<RowKey, int> known;
    std::vector<RowKey> keys;
    for (int k = 0; k < count; ++k) {
      const RowKey key{id(random), id(random), id(random), id(random)};
      known.try_emplace(key, k);
      keys.push_back(key);
    }
    index.assign(keys, std::identity{});
    for (int k = 0; k < 2000; ++k) {
      const RowKey key{id(random), id(random), id(random), id(random)};
      const auto found = known.find(key);
      EXPECT_EQ(index.find(key), found == known.end() ? -1 : found->second);
    }
  }
}

}  // namespace
}  // namespace crumple::sim::contact
