#include "server/io/json_position.h"

#include <gtest/gtest.h>

namespace crumple::io {
namespace {

constexpr std::string_view kText = R"({
  "name": "a \" } ] b",
  "dt": 0.01,
  "bodies": [
    { "name": "x", "list": [1, 2,
      3] },
    { "fem": {
        "material": {"young": 1e7,
          "poissonRatio": 0.5 } } }
  ]
})";

TEST(JsonPosition, FindsTheLineOfAPath) {
  EXPECT_EQ(line_of(kText, ""), 1);
  EXPECT_EQ(line_of(kText, "name"), 2);
  EXPECT_EQ(line_of(kText, "dt"), 3);
  EXPECT_EQ(line_of(kText, "bodies[0].list[1]"), 5);
  EXPECT_EQ(line_of(kText, "bodies[0].list[2]"), 6);
  EXPECT_EQ(line_of(kText, "bodies[1].fem.material.young"), 8);
}

TEST(JsonPosition, MatchesBothSpellingsOfAKey) { EXPECT_EQ(line_of(kText, "bodies[1].fem.material.poisson_ratio"), 9); }

TEST(JsonPosition, StopsAtTheInnermostPartThatIsThere) {
  EXPECT_EQ(line_of(kText, "bodies[1].fem.material.density"), 8);
  EXPECT_EQ(line_of(kText, "bodies[7].fem"), 4);
  EXPECT_EQ(line_of(kText, "gravity.x"), 1);
  EXPECT_EQ(line_of("", "a.b"), 1);
  EXPECT_EQ(line_of("[", "[3].b"), 1);
}

}  // namespace
}  // namespace crumple::io
