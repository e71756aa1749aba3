#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "server/sim/rigid/primitive_meshes.h"
#include "server/sim/rigid/rigid_world.h"

// Every kind of shape comes to rest where it should.
namespace crumple::sim {
namespace {

RigidModel body(const Shape& shape, RigidKind kind = RigidKind::dynamic) {
  RigidModel model;
  model.kind = kind;
  model.shapes = {{Pose{}, shape}};
  model.density = 100;
  model.restitution = 0;
  return model;
}

Pose at(double x, double y, double z) { return {Quat::Identity(), {x, y, z}}; }

// n x n squares of the given size about the origin, facing up.
SurfaceMesh floor_mesh(int n, double size) {
  SurfaceMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) mesh.vertices.push_back({size * (i - n / 2.0), 0, size * (j - n / 2.0)});
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  }
  return mesh;
}

struct RestCase {
  const char* name;
  RigidModel model;
  double height;  // of the origin at rest
};

void PrintTo(const RestCase& c, std::ostream* out) { *out << c.name; }

class Rest : public testing::TestWithParam<RestCase> {};

std::vector<RestCase> rest_cases() {
  RigidModel compound = body(Box{{0.5, 0.25, 0.5}});
  compound.shapes.push_back({at(0.3, 0.5, 0), Sphere{0.3}});
  RigidModel mixed = body(Box{{0.5, 0.25, 0.5}});
  mixed.shapes.push_back({at(0, 0.5, 0), TriangleShape{box_surface({0.3, 0.3, 0.3})}});
  return {{"box", body(Box{{0.5, 0.25, 0.5}}), 0.25},
          {"sphere", body(Sphere{0.3}), 0.3},
          {"cylinder", body(Cylinder{0.3, 0.4}), 0.4},
          {"hull", body(ConvexHull{box_surface({0.5, 0.25, 0.5}).vertices}), 0.25},
          {"triangles", body(TriangleShape{box_surface({0.5, 0.25, 0.5})}), 0.25},
          {"compound", compound, 0.25},
          {"mixed", mixed, 0.25}};
}

void drop(RigidWorld& world, const RestCase& c, double floor_height, double jitter = 5e-3) {
  ASSERT_TRUE(world.add_body(1, c.model, at(0.13, floor_height + c.height + 0.2, 0.07)));
  double fastest = 0;
  for (int i = 0; i < 480; ++i) {
    ASSERT_TRUE(world.step(1.0 / 120).frozen.empty());
    if (i > 360) fastest = std::max(fastest, world.velocity(1).norm());
  }
  EXPECT_LT(fastest, jitter);
  EXPECT_NEAR(world.pose(1).p_WB.y(), floor_height + c.height, 4e-3);
  EXPECT_NEAR((world.pose(1).R_WB * Vec3::UnitY()).y(), 1, 1e-4);
}

TEST_P(Rest, OnAPlane) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(Plane{}, RigidKind::fixed), {}));
  drop(world, GetParam(), 0);
}

TEST_P(Rest, OnAFixedBox) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(Box{{3, 0.5, 3}}, RigidKind::fixed), {}));
  drop(world, GetParam(), 0.5);
}

TEST_P(Rest, OnATriangleFloor) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(TriangleShape{floor_mesh(8, 0.5)}, RigidKind::fixed), {}));
  // Bullet's GImpact forgets its contacts every step, so a moving mesh on a fixed one trembles by half of g dt.
  const bool gimpact = std::string(GetParam().name) == "triangles";
  drop(world, GetParam(), 0, gimpact ? 0.05 : 5e-3);
}

INSTANTIATE_TEST_SUITE_P(, Rest, testing::ValuesIn(rest_cases()), [](const auto& info) { return info.param.name; });

TEST(RigidWorld, HullsStack) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(Plane{}, RigidKind::fixed), {}));
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(
        world.add_body(i + 1, body(ConvexHull{box_surface({0.5, 0.5, 0.5}).vertices}), at(0, 0.51 + 1.01 * i, 0)));
  for (int i = 0; i < 600; ++i) world.step(1.0 / 120);
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(world.com(i + 1).y(), 0.5 + i, 0.015);
    EXPECT_LT(world.velocity(i + 1).norm(), 5e-3);
  }
}

TEST(RigidWorld, BoxSlidesOverATessellatedFloorWithoutBumps) {  // STABILITY row 37
  for (const bool as_hull : {false, true}) {
    RigidWorld world;
    RigidModel floor = body(TriangleShape{floor_mesh(40, 0.37)}, RigidKind::fixed);
    floor.friction = 0;
    ASSERT_TRUE(world.add_body(0, floor, {}));
    const Quat yaw(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
    const Vec3 half(0.4, 0.2, 0.3);
    const Shape shape = as_hull ? Shape(ConvexHull{box_surface(half).vertices}) : Shape(Box{half});
    ASSERT_TRUE(world.add_body(1, body(shape), {yaw, {-5, 0.2, 0}}, {3, 0, 1}));
    double kick = 0;
    for (int i = 0; i < 240; ++i) {
      world.step(1.0 / 120);
      if (i > 20) kick = std::max(kick, std::abs(world.velocity(1).y()));
    }
    EXPECT_LT(kick, 0.01 * std::sqrt(10.0)) << as_hull;
    EXPECT_NEAR(world.velocity(1).x(), 3, 0.03);
    EXPECT_LT(world.angular_velocity(1).norm(), 0.03);
  }
}

TEST(RigidWorld, FloorWithDegenerateTrianglesCarries) {  // STABILITY row 35
  SurfaceMesh floor = floor_mesh(4, 1);
  floor.triangles.push_back({0, 0, 1});
  floor.triangles.push_back({10, 11, 12});
  floor.triangles.push_back(floor.triangles[3]);
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(TriangleShape{floor}, RigidKind::fixed), {}));
  drop(world, rest_cases()[0], 0);
}

TEST(RigidWorld, TwoTriangleBodiesMeetWithoutBeingThrown) {  // STABILITY row 36: no ejection above 10 m/s
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(Plane{}, RigidKind::fixed), {}));
  for (const BodyId id : {1, 2}) {
    ASSERT_TRUE(world.add_body(id, body(TriangleShape{icosphere(0.5, 2)}), at(id == 1 ? -1 : 1, 0.6, 0),
                               {id == 1 ? 5.0 : -5.0, 0, 0}));
  }
  for (int i = 0; i < 480; ++i) {
    world.step(1.0 / 240);
    ASSERT_LT(world.velocity(1).norm(), 10);
    ASSERT_LT(world.velocity(2).norm(), 10);
  }
  EXPECT_LT(world.com(1).x(), world.com(2).x());
}

TEST(RigidWorld, DeformingPartsRestWhereTheyNowAre) {
  RigidWorld world;
  ASSERT_TRUE(world.add_body(0, body(Plane{}, RigidKind::fixed), {}));
  std::vector<Vec3> points = box_surface({0.5, 0.5, 0.5}).vertices;
  const std::vector<double> masses(8, 1.0);
  for (const bool triangles : {false, true}) {
    const auto shape = [&] {
      return triangles ? DeformableShape(SurfaceMesh{points, box_surface({1, 1, 1}).triangles})
                       : DeformableShape(std::vector<ConvexHull>{{points}});
    };
    points = box_surface({0.5, 0.5, 0.5}).vertices;
    const BodyId id = triangles ? 2 : 1;
    ASSERT_TRUE(world.add_deformable(id, shape(), point_mass(points, masses), 0.5, 0, at(3.0 * id, 0.5, 0)));
    for (int i = 0; i < 120; ++i) {
      for (Vec3& p : points)
        p.y() = std::max(p.y(), -0.5 + i / 400.0);  // its bottom is pressed in by 0.3 m in a second
      ASSERT_TRUE(world.set_shape_and_mass(id, shape(), point_mass(points, masses)));
      world.step(1.0 / 120);
    }
    for (int i = 0; i < 120; ++i) world.step(1.0 / 120);
    EXPECT_NEAR(world.pose(id).p_WB.y(), 0.5 - 119 / 400.0, 5e-3) << triangles;
    EXPECT_LT(world.velocity(id).norm(), 5e-3);
  }
}

TEST(RigidWorld, ShapesThatCannotBeAreErrors) {
  RigidWorld world;
  EXPECT_EQ(world.add_body(0, body(Plane{}), {}).error().field, "shapes[0]");
  EXPECT_EQ(world.add_body(0, body(Plane{}, RigidKind::kinematic), {}).error().field, "shapes[0]");
  EXPECT_EQ(world.add_body(0, body(TriangleShape{floor_mesh(2, 1)}), {}).error().field, "shapes[0]");
  EXPECT_EQ(world.add_body(0, body(TriangleShape{}, RigidKind::fixed), {}).error().field, "shapes[0]");
  EXPECT_FALSE(world.contains(0));
}

}  // namespace
}  // namespace crumple::sim
