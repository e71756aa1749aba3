#include "server/sim/example_based/secondary_goal.h"

#include "server/sim/example_based/deform.h"
#include "tests/sim/example_based/bar_fixture.h"

#include <cstring>

namespace crumple::sim::example_based {
namespace {

using Goal = ExampleParameters::SecondaryGoal;
constexpr double kMass = 500;  // [kg]

// Bars of three bones with `count` examples, drawn at random; without turns, skinning is linear.
std::shared_ptr<ExampleSet> many_examples(int count, bool turns) {
  std::mt19937 random(7);
  std::vector<std::vector<BoneTransform>> poses;
  for (int e = 0; e < count; ++e) {
    std::vector<BoneTransform> pose;
    for (int b = 0; b < 3; ++b) {
      const Vec3 t = 0.15 * random_vector(random), axis = random_vector(random);
      pose.push_back(turns ? turn(15, axis, t) : turn(0, Vec3::UnitX(), t));
    }
    poses.push_back(pose);
  }
  return make_set(bar_mesh({3, 3, 8}, 0.2), {Vec3(0, 0, -0.8), Vec3::Zero(), Vec3(0, 0, 0.8)}, poses);
}

// Beside each example of `car` one that goes half as far.
std::shared_ptr<ExampleSet> car_with_halves() {
  auto set = car();
  const int authored = set->example_count();
  for (int e = 1; e < authored; ++e) {
    Example half = set->examples[e];
    for (BoneTransform& T : half.bones) T = {Quat::Identity().slerp(0.5, T.q), 0.5 * T.t};
    set->examples.push_back(half);
  }
  return set;
}

struct Struck {
  ExampleRest rest;
  ExampleState state;
  std::vector<Vec3> x;  // where the shape had come to rest, before the goal was pursued
  WeightMatrix E;

  // Blows all over the body, and steps until nothing changes any more.
  Struck(std::shared_ptr<ExampleSet> set, Goal goal, int threads = 1) : rest(make_rest(std::move(set))) {
    ExampleParameters p;
    p.secondary_goal = goal;
    state = make_state(rest, p);
    ExampleWorkspace work;
    std::mt19937 random(3);
    const ThreadPool pool(threads);
    for (int k = 0; k < 2000; ++k) {
      std::vector<VertexImpulse> blows;
      for (int b = 0; k % 10 == 0 && k < 60 && b < 4; ++b)
        blows.push_back({rest.surface_vertices[random() % rest.surface_vertices.size()], 300 * random_vector(random)});
      deform(rest, p, {.dt = 0.004, .rate_dt = 0.004}, kMass, blows, pool, state, work);
      if (!state.active.empty()) x.clear();
      else if (x.empty()) x = state.x, E = state.E;
      if (is_at_rest(state) && k >= 60) break;
    }
    EXPECT_TRUE(is_at_rest(state));
  }

  double moved() const {  // over the body's size
    double most = 0;
    for (std::size_t i = 0; i < x.size(); ++i) most = std::max(most, (state.x[i] - x[i]).norm());
    return most / rest.size;
  }
};

struct Used {
  double mean = 0;
  int most = 0;
};
Used used_examples(const WeightMatrix& E) {  // of dented vertices
  Used used;
  int rows = 0;
  for (int i = 0; i < E.rows(); ++i) {
    if (E(i, 0) >= 1) continue;
    const int count = static_cast<int>((E.row(i).array() > 0).count());
    used.mean += count;
    used.most = std::max(used.most, count);
    ++rows;
  }
  used.mean /= rows;
  return used;
}

double variation(const ExampleRest& rest, const WeightMatrix& E) {
  double sum = 0;
  for (int i = 0; i < E.rows(); ++i)
    for (int k = rest.graph.start[i]; k < rest.graph.start[i + 1]; ++k)
      sum += (E.row(i) - E.row(rest.graph.neighbour[k])).squaredNorm() / rest.graph.length[k];
  return sum;
}

TEST(SecondaryGoal, FewExamplesAreFourAtMostWhereSkinningIsLinear) {  // Caratheodory: one more than the rank of J
  for (const int count : {3, 6, 20}) {
    const Struck plain(many_examples(count, false), Goal::none), few(many_examples(count, false), Goal::few_examples);
    EXPECT_TRUE(plain.rest.linear);
    EXPECT_EQ(std::memcmp(plain.state.E.data(), few.E.data(), sizeof(double) * plain.state.E.size()), 0) << "until it rests nothing differs";
    const Used before = used_examples(plain.state.E), after = used_examples(few.state.E);
    EXPECT_LE(after.most, 4);
    EXPECT_LE(after.mean, before.mean);
    EXPECT_LT(few.moved(), 1e-4);
    EXPECT_LT(simplex_error(few.state.E), 1e-12);
    RecordProperty("used_" + std::to_string(count), std::to_string(before.mean) + " -> " + std::to_string(after.mean));
    std::printf("%d examples: %.2f (%d at most) used at a dented vertex, with few_examples %.2f (%d); moved %.1e of the size\n", count, before.mean,
                before.most, after.mean, after.most, few.moved());
    if (count == 20) {
      EXPECT_LT(after.mean, 0.5 * before.mean);
    }
  }
}

TEST(SecondaryGoal, FewExamplesWithTurnsKeepTheShape) {
  for (const auto& set : {many_examples(12, true), car_with_halves()}) {
    const Struck plain(set, Goal::none), few(set, Goal::few_examples);
    const Used before = used_examples(plain.state.E), after = used_examples(few.state.E);
    std::printf("turning: %.2f (%d) used, with few_examples %.2f (%d); moved %.1e of the size\n", before.mean, before.most, after.mean, after.most,
                few.moved());
    EXPECT_LT(after.mean, 0.75 * before.mean);
    EXPECT_LE(few.moved(), 1e-4 * (1 + 1e-9));
    EXPECT_LT(simplex_error(few.state.E), 1e-12);
  }
}

TEST(SecondaryGoal, OneOfTwoEqualExamplesIsEnough) {
  auto set = car();
  set->examples.push_back(set->examples[1]);
  const Struck plain(set, Goal::none), few(set, Goal::few_examples);
  ASSERT_GT(plain.state.E.col(4).maxCoeff(), 0.01) << "eq. 8 strikes a balance";
  int both = 0;
  for (int i = 0; i < few.state.E.rows(); ++i) both += few.state.E(i, 1) > 0 && few.state.E(i, 4) > 0;
  EXPECT_EQ(both, 0);
  EXPECT_LE(few.moved(), 1e-4);
}

TEST(SecondaryGoal, SmoothWeightsVaryLess) {
  for (const bool turns : {false, true}) {
    const auto set = many_examples(12, turns);
    const Struck plain(set, Goal::none), smooth(set, Goal::smooth_weights);
    const double before = variation(plain.rest, plain.state.E), after = variation(smooth.rest, smooth.state.E);
    std::printf("smooth%s: variation %.3f -> %.3f, moved %.1e of the size\n", turns ? ", turning" : "", before, after, smooth.moved());
    EXPECT_LT(after, 0.8 * before);
    EXPECT_LE(smooth.moved(), 1e-4 * (1 + 1e-9));
    EXPECT_LT(simplex_error(smooth.state.E), 1e-12);
    for (int i = 0; i < plain.rest.vertex_count(); ++i) {
      if (plain.state.E(i, 0) == 1) {
        EXPECT_EQ(smooth.state.E(i, 0), 1) << "what is not dented stays";
      }
    }
  }
}

TEST(SecondaryGoal, BitsDoNotDependOnThreads) {
  for (const Goal goal : {Goal::few_examples, Goal::smooth_weights}) {
    const Struck one(many_examples(12, true), goal), two(many_examples(12, true), goal, 2);
    EXPECT_EQ(std::memcmp(one.state.E.data(), two.state.E.data(), sizeof(double) * one.state.E.size()), 0);
    EXPECT_EQ(one.state.x, two.state.x);
  }
}

TEST(SecondaryGoal, OfThreeExamplesThatAreNoneTooManyNothingChanges) {
  const Struck plain(car(), Goal::none), few(car(), Goal::few_examples);
  // Three ways to move and four weights that sum to one: no freedom is left.
  EXPECT_LT((plain.state.E - few.state.E).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_LE(few.moved(), 1e-4);
}

}  // namespace
}  // namespace crumple::sim::example_based
