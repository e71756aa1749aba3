#include "server/authoring/surface_distance.h"

#include "server/authoring/shapes/surfaces.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple::authoring {
namespace {

// Distance to a box from outside and inside, in closed form.
double box_distance(const Vec3& p, const Vec3& half) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.maxCoeff() <= 0 ? -q.maxCoeff() : q.cwiseMax(0.0).norm();
}

TEST(SurfaceDistance, ToABoxIsTheClosedForm) {
  const Vec3 half(0.5, 1, 2);
  const SurfaceDistance distance(box_surface(half));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-3, 3);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p(coordinate(random), coordinate(random), coordinate(random));
    const auto nearest = distance.nearest(p);
    EXPECT_NEAR(nearest.distance, box_distance(p, half), 1e-12);
    EXPECT_NEAR((nearest.point - p).norm(), nearest.distance, 1e-12);
    EXPECT_NEAR(box_distance(nearest.point, half), 0, 1e-12);
  }
}

TEST(SurfaceDistance, TreeFindsWhatASearchOfAllTrianglesFinds) {
  const sim::SurfaceMesh sphere = icosphere(1, 3);
  const SurfaceDistance distance(sphere);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> coordinate(-2, 2);
  for (int k = 0; k < 200; ++k) {
    const Vec3 p(coordinate(random), coordinate(random), coordinate(random));
    double best = 1e9;
    for (const auto& [a, b, c] : sphere.triangles)
      best = std::min(
          best,
          (nearest_point_on_triangle(p, {sphere.vertices[a], sphere.vertices[b], sphere.vertices[c]}) - p).norm());
    EXPECT_DOUBLE_EQ(distance(p), best);
  }
}

TEST(NearestPointOnTriangle, OfADegenerateTriangleLiesOnItsEdges) {
  EXPECT_EQ(nearest_point_on_triangle({1, 1, 0}, {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(1, 0, 0)}), Vec3(1, 0, 0));
  EXPECT_EQ(nearest_point_on_triangle({1, 1, 0}, {Vec3(3, 0, 0), Vec3(3, 0, 0), Vec3(3, 0, 0)}), Vec3(3, 0, 0));
}

}  // namespace
}  // namespace crumple::authoring
