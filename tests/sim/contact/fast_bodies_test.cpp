// Bodies that move further in a step than they are thick [Parker & O'Brien 2009, section 6].
#include "server/sim/contact/detect.h"

#include <gtest/gtest.h>

#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::contact {
namespace {

constexpr double kDt = 1.0 / 60;  // [s]

// A block of 48 tets, of a size [m], the middle of its lower side at `foot`, moving by `way` in a step.
struct Block {
  TetMesh mesh = test::kuhn_lattice({2, 2, 2}, 0.5);
  CollisionMesh collision;
  std::vector<Vec3> x, v;
  std::vector<char> fixed;

  Block(const Vec3& size, const Vec3& foot, const Vec3& way) : v(mesh.X.size(), way / kDt), fixed(mesh.X.size(), 0) {
    for (Vec3& X : mesh.X) X = size.cwiseProduct(X - Vec3(0.5, 0, 0.5));
    collision = make_collision_mesh(mesh.tets, mesh.X, std::vector<double>(mesh.tets.size(), 1.0 / 48));
    x = mesh.X;
    for (Vec3& p : x) p += foot;
  }
  CollisionBody soft() const { return {&collision, x, v, fixed, std::nullopt, 0.5}; }
  CollisionBody rigid() const { return {&collision, x, {}, {}, RigidMotion{x[13], v[0], Vec3::Zero(), 1, true}, 0.5}; }
};

Block cube(double edge, const Vec3& foot, const Vec3& way) { return {Vec3::Constant(edge), foot, way}; }

// Of 2 x 0.02 x 2 m with its top at y = 0; nothing moves it.
Block thin_plate() {
  Block plate(Vec3(2, 0.02, 2), Vec3(0, -0.02, 0), Vec3::Zero());
  plate.fixed.assign(plate.x.size(), 1);
  return plate;
}

std::vector<ContactRow> rows_of(const CollisionBody& a, const CollisionBody& b) {
  const std::vector<CollisionBody> bodies{a, b};
  DetectionInput input;
  input.bodies = bodies;
  input.dt = kDt;
  return detect(input, ThreadPool(1));
}

// From 0.2 m above the plate to 0.7 m below it: at neither end do the two overlap.
TEST(FastBodies, AreTurnedBackOnTheirWayThroughAThinPlate) {
  const Block plate = thin_plate(), ball = cube(0.1, Vec3(0.03, 0.2, 0.04), Vec3(0, -0.9, 0));
  for (const CollisionBody& fast : {ball.soft(), ball.rigid()})
    for (const bool first : {true, false}) {
      const auto rows = first ? rows_of(fast, plate.soft()) : rows_of(plate.soft(), fast);
      ASSERT_FALSE(rows.empty());
      Vec3 r = Vec3::Zero();
      for (const ContactRow& row : rows) {
        const Vec3 onto_cube = first ? row.normal : Vec3(-row.normal);
        r += row.area * onto_cube;
        EXPECT_GT(onto_cube.y(), -0.01);  // also those found more than half through: none pushes on
        EXPECT_LT(row.depth, 0.005);      // they were apart at the start of the step (sideways: about so),
        if (onto_cube.y() < 0.99) continue;
        // and may close the gap that was between the two tets: 0.2 m, of the cube's upper ones 0.05 m more.
        EXPECT_NEAR(row.target * kDt, -0.22, 0.035);
      }
      EXPECT_GT(r.normalized().y(), 0.95) << r.transpose();  // back to where it came from
    }
}

TEST(FastBodies, DoNotSlipBetweenTwoSamples) {
  const Block plate = thin_plate();
  for (double height = 0.01; height < 0.4; height += 0.0137)
    for (const double way : {0.6, 0.8, 1.0}) {
      const Block ball = cube(0.15, Vec3(0.03, height, 0.04), Vec3(0, -way, 0));
      EXPECT_FALSE(rows_of(ball.soft(), plate.soft()).empty()) << height << " " << way;
    }
}

TEST(FastBodies, ThatFlyPastMeetNothing) {
  const Block plate = thin_plate();
  const Block along = cube(0.1, Vec3(0, 0.01, 0), Vec3(0.9, 0, 0)), away = cube(0.1, Vec3(0, 0.01, 0), Vec3(0, 0.9, 0)),
              beside = cube(0.1, Vec3(1.2, 0.5, 0), Vec3(0, -0.9, 0));
  for (const Block& ball : {along, away, beside}) EXPECT_TRUE(rows_of(ball.soft(), plate.soft()).empty());
}

// A body that moves by less than a sixth of its diagonal is looked at once, at the end of the step; a faster one first
// where it has gone a part of its way, and that overlap is shallower.
TEST(FastBodies, SlowOnesAreLookedAtOnceAtTheEndOfTheStep) {
  const Block ground = cube(1, Vec3(0, -1, 0), Vec3::Zero());
  const auto middle_of_overlap = [&](double way) {
    const Block box = cube(0.3, Vec3(0.01, -0.005, 0.02), Vec3(0, -way, 0));
    double height = 0, area = 0;
    for (const ContactRow& row : rows_of(box.soft(), ground.soft())) {
      height += row.area * row.point.y();
      area += row.area;
    }
    EXPECT_GT(area, 0);
    return height / area;
  };
  const double diagonal = 0.3 * std::sqrt(3.0), slow = 0.16 * diagonal;
  EXPECT_NEAR(middle_of_overlap(slow), -(0.005 + slow) / 2, 0.015);                // 44 mm deep, half of the overlap
  EXPECT_NEAR(middle_of_overlap(0.5 * diagonal), middle_of_overlap(slow), 0.015);  // a third of three times the way
}

}  // namespace
}  // namespace crumple::sim::contact
