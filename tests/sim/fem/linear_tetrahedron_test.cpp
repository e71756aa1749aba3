#include "server/sim/fem/linear_tetrahedron.h"

#include "server/sim/fem/corotational.h"
#include "server/sim/fem/rotation.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

constexpr double kNoClamp = std::numeric_limits<double>::infinity();

Mat34 unit_corner() {
  Mat34 X;
  X << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  return X;
}

TEST(LinearTetrahedron, VolumeAndNormalsOfTheUnitCorner) {
  const RestTet tet = make_rest_tet(unit_corner(), kNoClamp);
  EXPECT_DOUBLE_EQ(tet.volume, 1.0 / 6);
  Mat34 normals;
  normals << 0.5, -0.5, 0, 0, 0.5, 0, -0.5, 0, 0.5, 0, 0, -0.5;
  EXPECT_LT((tet.normals - normals).norm(), 1e-15);
}

TEST(LinearTetrahedron, DeformationGradientOfAnAffineMapIsItsMatrix) {
  test::Random random;
  const Mat3 A = random.mat3(-2, 2);
  const Mat34 x = (A * unit_corner()).colwise() + random.vec3(-5, 5);
  EXPECT_LT((deformation_gradient(x, make_rest_tet(unit_corner(), kNoClamp).beta) - A).norm(), 1e-14);
}

// CITED: a sliver of height 1e-3 and limit 10. Used naively, the clamped basis gives it a rest strain of 0.99.
TEST(LinearTetrahedron, ClampedSliverIsStressFreeAtRestAndBoundedInStiffness) {
  Mat34 X = unit_corner();
  X(2, 3) = 1e-3;
  const RestTet sliver = make_rest_tet(X, 10), plain = make_rest_tet(X, kNoClamp);
  ASSERT_TRUE(sliver.clamped);
  EXPECT_EQ(sliver.volume, plain.volume);
  EXPECT_NEAR(Eigen::JacobiSVD<Mat3>(sliver.beta_clamped).singularValues()(0), 10, 1e-12);
  EXPECT_GT((deformation_gradient(X, sliver.beta_clamped) - Mat3::Identity()).norm(), 0.98);
  EXPECT_LT(corotational_strain(sliver, X, Mat3::Identity()).norm(), 1e-12);
  const Mat3 R = test::Random().rotation();
  EXPECT_LT(corotational_strain(sliver, R * X, R).norm(), 1e-12);
  EXPECT_LT(sliver.normals.rowwise().sum().norm(), 1e-15);
  const Lame lame = lame_constants(1e6, 0.3);
  const double ratio = stiffness_block(plain, lame, Mat3::Identity(), 3, 3).norm() /
                       stiffness_block(sliver, lame, Mat3::Identity(), 3, 3).norm();
  EXPECT_NEAR(ratio, 1e4, 500);  // (1000 / 10)^2
}

TEST(LinearTetrahedron, WellShapedTetIsNotClamped) {
  const RestTet tet = make_rest_tet(unit_corner(), 20 / 1.2);
  EXPECT_FALSE(tet.clamped);
  EXPECT_EQ(tet.beta_clamped, tet.beta);
  EXPECT_EQ(tet.rest_gradient, Mat3::Identity());
}

TEST(RestBody, MassIsDensityTimesFilledVolumeLumpedInQuarters) {
  TetMesh mesh = test::kuhn_box(2, 1, 1, {2, 1, 1});
  FemMaterial material;
  material.density = 300;
  EXPECT_NEAR(test::rest_body(mesh, material).mass(), 600, 1e-10);
  mesh.fill.assign(mesh.tets.size(), 0.25);
  const RestBody rest = test::rest_body(mesh, material);
  EXPECT_NEAR(rest.mass(), 150, 1e-10);
  EXPECT_NEAR(test::rest_body(test::regular_tet(), material).node_mass[2], 300 * (8.0 / 3) / 4, 1e-10);
}

TEST(RestBody, MassesFollowTheTetsAfterASplit) {
  const TetMesh mesh = test::kuhn_box(1, 1, 1, {1, 1, 1});
  RestBody rest = test::rest_body(mesh, {});
  std::vector<Tet> tets = mesh.tets;
  const int old_node = tets[0][1];
  tets[0][1] = 8;  // one tet gets a copy of the node
  const double before = rest.node_mass[old_node];
  follow_topology(rest, tets, 9);
  EXPECT_NEAR(rest.node_mass[8], 1000.0 / 24, 1e-10);
  EXPECT_NEAR(rest.node_mass[old_node] + rest.node_mass[8], before, 1e-10);
  EXPECT_NEAR(rest.mass(), 1000, 1e-10);
}

TEST(RestBody, BadInputIsNamed) {
  const TetMesh mesh = test::regular_tet();
  FemMaterial material;
  material.poisson = 0.5;
  EXPECT_EQ(make_rest_body(mesh, material).error().field, "material.poisson");
  material = {};
  material.young = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(make_rest_body(mesh, material).error().field, "material.young");
  material = {};
  material.creep = -0.1;
  EXPECT_EQ(make_rest_body(mesh, material).error().field, "material.creep");
  TetMesh flat = mesh;
  for (Vec3& X : flat.X) X.z() = 0;
  EXPECT_FALSE(make_rest_body(flat, {}).has_value());
  EXPECT_EQ(make_rest_body(mesh, {}, -1).error().field, "clamp_limit");
  EXPECT_TRUE(make_rest_body(mesh, {}).has_value());
}

}  // namespace
}  // namespace crumple::sim::fem
