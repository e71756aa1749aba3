#include "server/sim/example_based/skinning.h"

#include "tests/sim/example_based/bar_fixture.h"

namespace crumple::sim::example_based {
namespace {

// One bone, so that a whole body turns with it.
ExampleRest one_bone(const std::vector<BoneTransform>& poses) {
  std::vector<std::vector<BoneTransform>> examples;
  for (const BoneTransform& T : poses) examples.push_back({T});
  return make_rest(make_set(bar_mesh({1, 1, 1}, 0.2), {Vec3::Zero()}, examples));
}

double blend_norm(double degrees, bool aligned) {
  const std::vector<Quat> q{Quat::Identity(), turn(degrees, Vec3(1, 2, 3)).q};
  const double sign = aligned ? alignment_signs(q)[1] : 1;
  return (0.5 * q[0].coeffs() + 0.5 * sign * q[1].coeffs()).norm();
}

TEST(Qlerp, AlignmentKeepsTheBlendOfALargeTurnLong) {  // FORMULAS F16
  EXPECT_NEAR(blend_norm(350, false), 0.0436, 5e-5);
  EXPECT_NEAR(blend_norm(350, true), 0.9990, 5e-5);
  EXPECT_NEAR(blend_norm(359, false), 0.0044, 5e-5);
  EXPECT_NEAR(blend_norm(359, true), 0.99999, 5e-6);
}

TEST(Qlerp, HalfTurnsAgreeWhateverTheirStoredSign) {
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, -1, 0), Vec3(-2, 1, 2)})
    for (double degrees : {180.0, 540.0, -180.0}) {
      const Quat half = turn(degrees, axis).q;
      const std::vector<Quat> q{Quat::Identity(), half, Quat(-half.coeffs()), half};
      const auto s = alignment_signs(q);
      EXPECT_EQ(s[1], -s[2]);
      EXPECT_EQ(s[1], s[3]);
    }
}

TEST(Qlerp, AHalfTurnGoesTheSameWayRoundWhateverTheRestPosesStoredSign) {
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(-2, 1, 2)})
    for (const Quat& rest : {Quat::Identity(), turn(70, Vec3(3, 1, -1)).q}) {
      const Quat half = turn(180, axis).q * rest;
      const auto middle = [&](const Quat& rest_pose, const Quat& pose) -> Mat3 {
        const Vec4 blend = rest_pose.coeffs() + alignment_signs(std::vector<Quat>{rest_pose, pose})[1] * pose.coeffs();
        return Quat(blend).normalized().toRotationMatrix();
      };
      const Mat3 quarter = middle(rest, half);
      const Quat other_rest(-rest.coeffs()), other_half(-half.coeffs());
      EXPECT_LT((middle(other_rest, half) - quarter).norm(), 1e-12);
      EXPECT_LT((middle(rest, other_half) - quarter).norm(), 1e-12);
      EXPECT_LT((middle(other_rest, other_half) - quarter).norm(), 1e-12);
    }
}

TEST(Qlerp, EvenOppositeHalfTurnsDoNotDivideByZero) {
  // 179.9 degrees about +x and -x: both are kept on the rest pose's side, so they cancel all but completely.
  const ExampleRest rest = one_bone({turn(179.9, Vec3::UnitX()), turn(-179.9, Vec3::UnitX())});
  for (double s = 0; s <= 1; s += 1e-3) {
    const Vec3 x = skin_vertex(rest, 3, WeightRow{{0, 1 - s, s}});
    ASSERT_TRUE(x.allFinite());
    EXPECT_NEAR(x.norm(), rest.x_rest[3].norm(), 1e-12);
  }
  const Vec4 zero = Vec4::Zero();
  EXPECT_NEAR(guarded(zero, Vec4::UnitW()).norm(), kMinBlendNorm, 1e-15);
  const WeightRow middle{{0, 0.5, 0.5}};
  EXPECT_TRUE(skinning_jacobian(rest, 3, middle).allFinite());
}

TEST(Skinning, RestRowKeepsEveryVertex) {  // FORMULAS F16
  auto set = car();
  set->W *= 1 + 5e-7;  // rows that a text file rounded
  const ExampleRest rest = make_rest(set);
  WeightRow row = WeightRow::Zero(4);
  row[0] = 1;
  WeightRow almost = row;  // by the whole path, not the short cut
  almost[0] = 1 - 1e-16;
  almost[1] = 1e-300;
  for (int i = 0; i < rest.vertex_count(); ++i) {
    EXPECT_EQ(skin_vertex(rest, i, row), set->mesh.X[i]);
    EXPECT_LT((skin_vertex(rest, i, almost) - set->mesh.X[i]).norm(), 1e-12);
  }
}

TEST(Skinning, AnExampleThatMovesAllBonesAlikeIsRigid) {
  const BoneTransform T = turn(200, Vec3(1, -2, 0.5), Vec3(0.3, 0.1, -2));
  const auto set = make_set(bar_mesh({2, 2, 4}, 0.25), {Vec3(0, 0, -0.5), Vec3(0, 0, 0.5)}, {{T, T}});
  const ExampleRest rest = make_rest(set);
  for (int i = 0; i < rest.vertex_count(); ++i) {
    EXPECT_LT((skin_vertex(rest, i, WeightRow{{0, 1}}) - (T.q * set->mesh.X[i] + T.t)).norm(), 1e-12);
    // In between as well: half of 200 degrees is, aligned, -80 degrees about the same axis.
    const Vec3 half = turn(-80, Vec3(1, -2, 0.5)).q * set->mesh.X[i] + 0.5 * T.t;
    EXPECT_LT((skin_vertex(rest, i, WeightRow{{0.5, 0.5}}) - half).norm(), 1e-12);
  }
}

TEST(Skinning, QlerpBlendsAQuarterTurnAsItsClosedForm) {
  // Weight s between 0 and 90 degrees: tan(theta / 2) = s sin 45 / (1 - s + s cos 45).
  const ExampleRest rest = one_bone({turn(90, Vec3::UnitZ(), Vec3(1, 2, 3))});
  for (double s : {0.1, 0.25, 0.5, 0.9}) {
    const double h = std::numbers::sqrt2 / 2;
    const double theta = 2 * std::atan2(s * h, 1 - s + s * h);
    const Vec3 expected = Eigen::AngleAxisd(theta, Vec3::UnitZ()) * rest.x_rest[5] + s * Vec3(1, 2, 3);
    EXPECT_LT((skin_vertex(rest, 5, WeightRow{{1 - s, s}}) - expected).norm(), 1e-14);
  }
}

TEST(Skinning, RestPoseMayBeAnyPose) {
  auto set = car();
  for (BoneTransform& T : set->examples[0].bones) T = turn(120, Vec3(0, 1, 1), Vec3(0, 0, 1));
  const ExampleRest rest = make_rest(set);
  const ExampleState state = make_state(rest, {});
  for (int i = 0; i < rest.vertex_count(); ++i)
    EXPECT_LT((state.x[i] - set->examples[0].bones[0].q * set->mesh.X[i] - Vec3(0, 0, 1)).norm(), 1e-12);
}

double jacobian_error(const ExampleRest& rest, int i, const WeightRow& row) {
  constexpr double h = 1e-5;  // truncation h^2 and rounding 1e-16 / h: both near 1e-10
  const Jacobian J = skinning_jacobian(rest, i, row);
  double worst = 0;
  for (int e = 0; e < row.size(); ++e) {
    WeightRow ahead = row, behind = row;
    ahead[e] += h;
    behind[e] -= h;
    const Vec3 slope = (skin_vertex(rest, i, ahead) - skin_vertex(rest, i, behind)) / (2 * h);
    worst = std::max(worst, (slope - J.col(e)).norm());
  }
  return worst;
}

TEST(SkinningJacobian, MatchesCentralDifferences) {
  std::mt19937 random(1);
  const ExampleRest rest = make_rest(car());
  for (int n = 0; n < 200; ++n)
    EXPECT_LT(jacobian_error(rest, random() % rest.vertex_count(), random_row(4, random)), 1e-8);
  EXPECT_LT(jacobian_error(rest, 7, WeightRow{{1, 0, 0, 0}}), 1e-8);
}

TEST(SkinningJacobian, MatchesCentralDifferencesNearHalfTurns) {
  std::mt19937 random(2);
  for (double degrees : {90.0, 170.0, 179.0, 180.0, 181.0, 270.0, 350.0, 540.0}) {
    const Vec3 axis = random_vector(random), other = random_vector(random);
    const ExampleRest rest = one_bone({turn(degrees, axis, Vec3(0, 1, 0)), turn(60, other)});
    for (int n = 0; n < 20; ++n) {
      WeightRow row = random_row(3, random);
      row = 0.7 * row + 0.3 * WeightRow{{1, 0, 0}};  // away from where opposite turns cancel
      EXPECT_LT(jacobian_error(rest, n % 8, row), 1e-8) << degrees;
    }
  }
}

TEST(SkinningJacobian, HoldsInsideTheGuardOfShortBlends) {
  const ExampleRest rest = one_bone({turn(180, Vec3::UnitX()), turn(180, Vec3(-1, 1e-3, 0))});
  // sign alignment keeps these two together; push a blend into the guard by weights of either sign
  const WeightRow row{{2e-4, 0.5, -0.5}};
  const Vec4 Q = row[0] * rest.pose(0, 0).q + row[1] * rest.pose(0, 1).q + row[2] * rest.pose(0, 2).q;
  ASSERT_LT(Q.norm(), kMinBlendNorm);
  const Jacobian J = skinning_jacobian(rest, 6, row);
  constexpr double h = 1e-8;  // the blend is 1e-3 long: slopes are 1e3 times steeper, curvature 1e6
  for (int e = 0; e < 3; ++e) {
    WeightRow ahead = row, behind = row;
    ahead[e] += h;
    behind[e] -= h;
    const Vec3 slope = (skin_vertex(rest, 6, ahead) - skin_vertex(rest, 6, behind)) / (2 * h);
    EXPECT_LT((slope - J.col(e)).norm(), 1e-6 * J.norm());
  }
}

TEST(Skinning, IsContinuousAcrossLargeExamplesOfAnyStoredSign) {  // STABILITY 30
  std::mt19937 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<BoneTransform> poses;
    const Vec3 axis = trial % 2 ? random_vector(random) : Vec3::UnitX();
    for (double degrees : {90.0, 180.0, 270.0, 350.0, 540.0}) {
      poses.push_back(turn(degrees, axis));
      if (random() % 2) poses.back().q.coeffs() *= -1;
    }
    const ExampleRest rest = one_bone(poses);
    const double size = rest.x_rest[0].norm();  // 0.17 m
    for (int e = 1; e <= 5; ++e) {
      // From rest: |dx| <= 4 |u| dE, at the middle of a half turn, so below 1e-3 m for 1e-3 of weight here.
      Vec3 before = rest.x_rest[0];
      for (int k = 1; k <= 1000; ++k) {
        WeightRow row = WeightRow::Zero(6);
        row[0] = 1 - 1e-3 * k;
        row[e] = 1e-3 * k;
        const Vec3 x = skin_vertex(rest, 0, row);
        ASSERT_LT((x - before).norm(), 1e-3);
        ASSERT_NEAR(x.norm(), size, 1e-12);
        before = x;
      }
    }
    for (int n = 0; n < 200; ++n) {
      const Vec3 x = skin_vertex(rest, 0, random_row(6, random));
      ASSERT_NEAR(x.norm(), size, 1e-12);
    }
  }
}

TEST(Skinning, SkinsTheListedVerticesOnlyAndSaysWhetherTheyMoved) {
  const ExampleRest rest = make_rest(car());
  const ThreadPool pool(1);
  ExampleState state = make_state(rest, {});
  EXPECT_FALSE(skin(rest, state.E, std::vector<int>{3, 5}, pool, state.x));
  state.E.row(3) << 0.5, 0.5, 0, 0;
  state.E.row(4) << 0.5, 0.5, 0, 0;
  EXPECT_TRUE(skin(rest, state.E, std::vector<int>{3, 5}, pool, state.x));
  EXPECT_NE(state.x[3], rest.x_rest[3]);
  EXPECT_EQ(state.x[4], rest.x_rest[4]);
}

// Where no pose turns, eq. 3 is taken as u + sum_e E_ie D_ie. A further example that turns, with no weight, makes the
// same body take the general way.
TEST(Skinning, IsTheSameByTheLinearWayWhereNoPoseTurns) {
  std::mt19937 random(3);
  const std::vector<Vec3> bones{Vec3(0, 0, -0.8), Vec3::Zero(), Vec3(0, 0, 0.8)};
  const auto shift = [&] { return BoneTransform{Quat::Identity(), 0.3 * random_vector(random)}; };
  auto set = make_set(bar_mesh({3, 3, 8}, 0.2), bones, {{shift(), shift(), shift()}, {shift(), {}, shift()}});
  for (bool rest_moves : {false, true}) {
    if (rest_moves) set->examples[0].bones[1].t = Vec3(0.1, 0, -0.2);
    auto turning = std::make_shared<ExampleSet>(*set);
    turning->examples.push_back({"turned", {turn(30, Vec3::UnitX()), turn(20, Vec3::UnitY()), {}}});
    const ExampleRest linear = make_rest(set), general = make_rest(turning);
    ASSERT_TRUE(linear.linear);
    ASSERT_FALSE(general.linear);
    for (int i = 0; i < linear.vertex_count(); ++i) {
      const WeightRow row = random_row(3, random);
      WeightRow padded = WeightRow::Zero(4);
      padded.head(3) = row;
      EXPECT_LT((skin_vertex(linear, i, row) - skin_vertex(general, i, padded)).norm(), 1e-14);
      const Jacobian J = skinning_jacobian(linear, i, row);
      ASSERT_EQ(J.cols(), 3);
      EXPECT_LT((J - skinning_jacobian(general, i, padded).leftCols(3)).norm(), 1e-14);
      EXPECT_EQ(skin_vertex(linear, i, WeightRow::Unit(3, 0)), linear.x_rest[i]);
      if (!rest_moves) {
        EXPECT_EQ(linear.x_rest[i], set->mesh.X[i]);
      }
    }
  }
}

}  // namespace
}  // namespace crumple::sim::example_based
