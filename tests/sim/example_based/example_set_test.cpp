#include "tests/sim/example_based/bar_fixture.h"

#include <gmock/gmock.h>

namespace crumple::sim::example_based {
namespace {

using testing::HasSubstr;

std::string breach(const std::function<void(ExampleSet&)>& spoil) {
  auto set = car();
  EXPECT_TRUE(validate(*set, "set"));
  spoil(*set);
  const Result<void> result = validate(*set, "set");
  return result ? "accepted" : result.error().text();
}

TEST(ExampleSet, EachBreachIsNamedWithItsField) {
  EXPECT_THAT(breach([](auto& s) { s.mesh.tets.clear(); }), HasSubstr("set.mesh"));
  EXPECT_THAT(breach([](auto& s) { s.W.conservativeResize(5, 3); }), HasSubstr("set.W has 5 rows"));
  EXPECT_THAT(breach([](auto& s) { s.W(7, 1) = -0.1; }), HasSubstr("set.W[7][1] is -0.1"));
  EXPECT_THAT(breach([](auto& s) { s.W(7, 1) = NAN; }), HasSubstr("set.W[7][1] is nan"));
  EXPECT_THAT(breach([](auto& s) { s.W.row(2) << 0.5, 0.4, 0.09999; }), HasSubstr("set.W[2] sums to 0.99999"));
  EXPECT_THAT(breach([](auto& s) { s.examples.clear(); }), HasSubstr("set.examples is empty"));
  EXPECT_THAT(breach([](auto& s) { s.examples.resize(65, s.examples[0]); }), HasSubstr("at most 64"));
  EXPECT_THAT(breach([](auto& s) { s.examples[1].bones.pop_back(); }), HasSubstr("set.examples[1].bones has 2"));
  EXPECT_THAT(breach([](auto& s) { s.examples[1].bones[2].t.y() = INFINITY; }),
              HasSubstr("set.examples[1].bones[2].t"));
  EXPECT_THAT(breach([](auto& s) { s.examples[2].bones[0].q.coeffs().setZero(); }),
              HasSubstr("set.examples[2].bones[0].q has norm 0"));
  EXPECT_THAT(breach([](auto& s) { s.convex_parts.clear(); }), HasSubstr("set.convex_parts is empty"));
  EXPECT_THAT(breach([](auto& s) { s.convex_parts[0].resize(3); }), HasSubstr("set.convex_parts[0] has 3 vertices"));
  EXPECT_THAT(breach([](auto& s) { s.convex_parts[0][4] = 100000; }), HasSubstr("set.convex_parts[0][4] is 100000"));
  EXPECT_THAT(breach([](auto& s) { s.alpha_scale.assign(3, 1); }), HasSubstr("set.alpha_scale has 3 numbers"));
  EXPECT_THAT(breach([](auto& s) { s.alpha_scale.assign(s.vertex_count(), -1); }), HasSubstr("set.alpha_scale[0] is -1"));
  EXPECT_THAT(breach([](auto& s) { s.beta_scale.assign(s.vertex_count() + 1, 1); }), HasSubstr("set.beta_scale has"));
  EXPECT_THAT(breach([](auto& s) {
                s.beta_scale.assign(s.vertex_count(), 1);
                s.beta_scale[4] = NAN;
              }),
              HasSubstr("set.beta_scale[4] is nan"));
  EXPECT_THAT(breach([](auto& s) { s.render.vertices.push_back(Vec3::Zero()); }), HasSubstr("set.render"));
}

}  // namespace
}  // namespace crumple::sim::example_based
