#include "server/authoring/winding_number.h"

#include "server/authoring/shapes/surfaces.h"
#include "tests/authoring/surfaces_for_tests.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace crumple::authoring {
namespace {

std::vector<Vec3> random_points(int count, double reach) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  std::vector<Vec3> out;
  for (int k = 0; k < count; ++k) out.push_back({coordinate(random), coordinate(random), coordinate(random)});
  return out;
}

TEST(SolidAngle, OfACubeFaceFromTheCentreIsASixthOfTheSphere) {
  const double omega = solid_angle({0, 0, -1}, {Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0)}) +
                       solid_angle({0, 0, -1}, {Vec3(-1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 0)});
  EXPECT_NEAR(omega, 4 * std::numbers::pi / 6, 1e-14);
}

TEST(SolidAngle, OfAnOctantIsAnEighthOfTheSphere) {
  EXPECT_NEAR(solid_angle(Vec3::Zero(), {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}), std::numbers::pi / 2, 1e-14);
}

TEST(WindingNumber, IsOneInsideAndZeroOutsideOfAClosedSurface) {
  const sim::SurfaceMesh sphere = icosphere(1, 4);
  const WindingNumber w(sphere);
  for (const Vec3& q : random_points(2000, 1.5)) {
    if (std::abs(q.norm() - 1) < 0.01) continue;  // between the sphere and its facets
    const double expected = q.norm() < 1 ? 1 : 0;
    EXPECT_NEAR(w.exact(q), expected, 1e-9);
    EXPECT_NEAR(w(q), expected, 0.03);  // what the dipoles leave
    EXPECT_EQ(w.inside(q), expected == 1);
  }
}

TEST(WindingNumber, CountsOverlappingPartsTogether) {
  sim::SurfaceMesh two = box_surface(Vec3::Ones());
  append(two, box_surface(Vec3::Ones()), {Quat::Identity(), Vec3(1, 0, 0)});
  const WindingNumber w(two);
  EXPECT_NEAR(w({-0.5, 0.1, 0.2}), 1, 0.03);
  EXPECT_NEAR(w({0.5, 0.1, 0.2}), 2, 0.03);
  EXPECT_NEAR(w({1.5, 0.1, 0.2}), 1, 0.03);
  EXPECT_NEAR(w({2.5, 0.1, 0.2}), 0, 0.03);
}

TEST(WindingNumber, OfASelfIntersectingSurfaceIsStillDecided) {
  sim::SurfaceMesh twisted = icosphere(1, 3);
  // Pull one cap through the opposite side: the swept part turns inside out beyond it.
  for (Vec3& v : twisted.vertices)
    if (v.z() > 0.8) v.z() -= 2.2;
  const WindingNumber w(twisted);
  EXPECT_TRUE(w.inside({0.85, 0.05, 0.1}));
  EXPECT_FALSE(w.inside({0.01, 0.02, -1.15}));
  EXPECT_FALSE(w.inside({0.01, 0.02, 0.3}));
}

// From the middle of a sphere without its cap above z = cos(a) the missing solid angle is 2 pi (1 - cos(a)).
TEST(WindingNumber, OfAnOpenSphereIsTheSolidAngleItCovers) {
  const sim::SurfaceMesh open = test::opened_above(icosphere(1, 5), 0.5);
  const WindingNumber w(open);
  EXPECT_NEAR(w.exact(Vec3::Zero()), 0.75, 0.01);  // the rim follows the triangles
  EXPECT_NEAR(w(Vec3::Zero()), w.exact(Vec3::Zero()), 0.03);
  EXPECT_TRUE(w.inside({0, 0, -0.5}));
  EXPECT_FALSE(w.inside({0, 0, 1.5}));
  EXPECT_FALSE(w.inside({0, 0, -1.5}));
}

TEST(WindingNumber, TreeAgreesWithTheSumOnAnOpenSurface) {
  const WindingNumber w(test::opened_above(icosphere(1, 4), 0.2));
  for (const Vec3& q : random_points(1000, 2)) EXPECT_NEAR(w(q), w.exact(q), 0.03);
}

TEST(WindingNumber, OfNothingIsZero) { EXPECT_EQ(WindingNumber(sim::SurfaceMesh{})(Vec3::Zero()), 0); }

}  // namespace
}  // namespace crumple::authoring
