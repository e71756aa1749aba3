#include "server/sim/rigid/hull_faces.h"

#include "server/sim/rigid/convex_hull.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple::sim {
namespace {

double area_of(const HullFace& face, const SurfaceMesh& hull) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < face.corners.size(); ++k)
    sum += 0.5 * hull.vertices[face.corners[k]].cross(hull.vertices[face.corners[(k + 1) % face.corners.size()]]);
  return sum.dot(face.normal);
}

TEST(HullFaces, ABoxHasSixOfFourCorners) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) corners.push_back(Vec3(k & 1 ? 1 : -1, k & 2 ? 2 : -2, k & 4 ? 3 : -3));
  const auto hull = convex_hull(corners, "");
  ASSERT_TRUE(hull);
  const std::vector<HullFace> faces = hull_faces(*hull);
  ASSERT_EQ(faces.size(), 6u);
  double area = 0;
  for (const HullFace& face : faces) {
    EXPECT_EQ(face.corners.size(), 4u);
    EXPECT_NEAR(face.offset, face.normal.cwiseAbs().dot(Vec3(1, 2, 3)), 1e-12);
    area += area_of(face, *hull);
  }
  EXPECT_NEAR(area, 2 * (8 + 12 + 24), 1e-9);
}

TEST(HullFaces, ALidIsOneFaceAndARoundSideIsMany) {
  std::vector<Vec3> points;
  for (int k = 0; k < 24; ++k)
    for (double y : {-0.4, 0.4}) points.push_back(Vec3(0.3 * std::cos(k * M_PI / 12), y, 0.3 * std::sin(k * M_PI / 12)));
  const auto hull = convex_hull(points, "");
  ASSERT_TRUE(hull);
  const std::vector<HullFace> faces = hull_faces(*hull);
  EXPECT_EQ(faces.size(), 26u);
  EXPECT_EQ(std::ranges::count_if(faces, [](const HullFace& f) { return f.corners.size() == 24; }), 2);
}

TEST(HullFaces, CoverAnyHullOnceWithNothingOutside) {
  std::mt19937 random(4);
  std::normal_distribution<double> draw;
  for (int n = 0; n < 20; ++n) {
    std::vector<Vec3> points;
    for (int k = 0; k < 60; ++k) points.push_back(Vec3(draw(random), 0.3 * draw(random), draw(random)));
    const auto hull = convex_hull(points, "");
    ASSERT_TRUE(hull);
    const std::vector<HullFace> faces = hull_faces(*hull);
    double volume = 0;  // of the pyramids over the faces, were they plane
    for (const HullFace& face : faces) {
      ASSERT_GE(face.corners.size(), 3u);
      volume += area_of(face, *hull) * face.offset / 3;
      for (const Vec3& x : hull->vertices) ASSERT_LT(face.normal.dot(x) - face.offset, 0.05);  // sin 2.6 degrees
    }
    double exact = 0;
    for (const auto& [a, b, c] : hull->triangles)
      exact += hull->vertices[a].dot(hull->vertices[b].cross(hull->vertices[c])) / 6;
    EXPECT_NEAR(volume, exact, 0.03 * exact);
  }
}

}  // namespace
}  // namespace crumple::sim
