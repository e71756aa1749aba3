#include "server/sim/fem/assembly.h"

#include "server/sim/linear_solver/cholesky.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

const ThreadPool kOne(1);

struct Shaken {
  TetMesh mesh = test::kuhn_box(4, 2, 2, {1, 0.5, 0.5});
  FemMaterial material;
  FemState state;
  Eigen::VectorXd f_ext;

  explicit Shaken(bool with_fill = true) {
    test::Random random;
    material.damping_mass = 0.7;
    material.damping_stiffness = 0.002;
    state = test::rest_state(mesh);
    const Mat3 R = random.rotation();
    for (Vec3& x : state.x) x = R * x + random.vec3(-0.02, 0.02);
    for (Vec3& v : state.v) v = random.vec3(-1, 1);
    for (Mat3& p : state.plastic_strain) p = 0.02 * symmetric_part(random.mat3(-1, 1));
    if (with_fill)
      for (int t = 0; t < mesh.tet_count(); ++t) mesh.fill.push_back(random.uniform(0.1, 1));
    f_ext = Eigen::VectorXd::NullaryExpr(3 * mesh.node_count(), [&] { return random.uniform(-5, 5); });
  }
};

// Eq. 5 written out with whole matrices: K from the blocks of eq. 2, tet by tet.
TEST(Assembly, SystemIsEquationFive) {
  const Shaken s;
  const RestBody rest = test::rest_body(s.mesh, s.material);
  const double dt = 1.0 / 60;
  StepSystem system;
  assemble(rest, s.mesh.tets, s.state, s.f_ext, dt, {}, kOne, system);

  const Eigen::MatrixXd K =
      tangent_stiffness(rest, s.mesh.tets, s.state.x, s.state.plastic_strain, Tangent::fixed_rotation);
  Eigen::VectorXd m(s.f_ext.size()), v(s.f_ext.size()), f(s.f_ext.size());
  for (int i = 0; i < rest.node_count(); ++i) {
    m.segment<3>(3 * i).setConstant(rest.node_mass[i]);
    v.segment<3>(3 * i) = s.state.v[i];
  }
  Elements elements;
  elastic_forces(rest, s.mesh.tets, s.state.x, s.state.plastic_strain, kOne, elements, f);
  const Eigen::MatrixXd M = m.asDiagonal(), C = s.material.damping_mass * M + s.material.damping_stiffness * K;
  const Eigen::MatrixXd A = M + dt * C + dt * dt * K;
  EXPECT_LT((system.to_sparse().toDense() - A).norm(), 1e-13 * A.norm());
  const Eigen::VectorXd b = dt * (s.f_ext + f) + m.cwiseProduct(v);
  EXPECT_LT((system.b - b).norm(), 1e-13 * b.norm());
  EXPECT_EQ(system.guess, v);
}

TEST(Assembly, PrescribedNodesAreStruckAndTheirValuesMovedToTheRight) {
  const Shaken s;
  const RestBody rest = test::rest_body(s.mesh, s.material);
  const std::vector<PrescribedNode> prescribed{{3, Vec3(0.1, -2, 0.3)}, {17, Vec3::Zero()}};
  StepSystem free, struck;
  assemble(rest, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, free);
  assemble(rest, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, prescribed, kOne, struck);

  // Reference: solve the free rows of A with the known columns on the right.
  const Eigen::MatrixXd A = free.to_sparse();
  std::vector<int> unknown;
  Eigen::VectorXd known = Eigen::VectorXd::Zero(free.b.size());
  for (const PrescribedNode& p : prescribed) known.segment<3>(3 * p.node) = p.velocity;
  for (int i = 0; i < rest.node_count(); ++i)
    if (i != 3 && i != 17) unknown.insert(unknown.end(), {3 * i, 3 * i + 1, 3 * i + 2});
  const Eigen::VectorXd rhs = (free.b - A * known)(unknown);
  Eigen::VectorXd expected = known;
  expected(unknown) = Eigen::VectorXd(Eigen::MatrixXd(A(unknown, unknown)).ldlt().solve(rhs));

  const Eigen::MatrixXd B = struck.to_sparse();
  EXPECT_EQ(B, B.transpose());
  EXPECT_LT((B.ldlt().solve(struck.b) - expected).norm(), 1e-11 * expected.norm());
  EXPECT_EQ(Vec3(struck.guess.segment<3>(9)), prescribed[0].velocity);
  EXPECT_TRUE(struck.prescribed[3] && struck.prescribed[17] && !struck.prescribed[4]);
}

TEST(Assembly, StressIsTurnedToTheWorld) {
  // Uniaxial strain of 1 % along a turned axis.
  const TetMesh mesh = test::kuhn_box(1, 1, 1, {1, 1, 1});
  FemMaterial material;
  material.poisson = 0;
  const RestBody rest = test::rest_body(mesh, material);
  FemState state = test::rest_state(mesh);
  const Mat3 R = test::Random().rotation();
  for (Vec3& x : state.x) x = R * Vec3(1.01 * x.x(), x.y(), x.z());
  Elements elements;
  update_elements(rest, mesh.tets, state.x, state.plastic_strain, kOne, elements);
  const Vec3 axis = R.col(0);
  for (int t = 0; t < mesh.tet_count(); ++t)
    EXPECT_LT((element_stress(rest, elements, t) - 1e4 * axis * axis.transpose()).norm(), 1e-6);
}

TEST(Assembly, SameBitsForOneAndTwoThreads) {
  const Shaken s;
  const RestBody rest = test::rest_body(s.mesh, s.material);
  StepSystem one, two;
  const std::vector<PrescribedNode> prescribed{{3, Vec3(0.1, -2, 0.3)}};
  assemble(rest, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, prescribed, kOne, one);
  assemble(rest, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, prescribed, ThreadPool(2), two);
  EXPECT_EQ(one.b, two.b);
  EXPECT_EQ((one.to_sparse() - two.to_sparse()).norm(), 0);
}

TEST(Assembly, PatternFollowsTheTets) {
  Shaken s(false);
  RestBody rest = test::rest_body(s.mesh, s.material);
  StepSystem system, fresh;
  assemble(rest, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, system);
  std::vector<Tet> tets = s.mesh.tets;
  const int copy = rest.node_count();
  s.state.x.push_back(s.state.x[tets[5][2]]);
  s.state.v.push_back(s.state.v[tets[5][2]]);
  tets[5][2] = copy;
  follow_topology(rest, tets, copy + 1);
  s.f_ext.conservativeResizeLike(Eigen::VectorXd::Zero(3 * copy + 3));
  assemble(rest, tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, system);
  assemble(rest, tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, fresh);
  EXPECT_EQ(system.node_count(), copy + 1);
  EXPECT_EQ((system.to_sparse() - fresh.to_sparse()).norm(), 0);
}

TEST(Assembly, ClampedTetsAreAssembledWithTheirClampedBasis) {
  Shaken s;
  const RestBody rest = test::rest_body(s.mesh, s.material, 5.0);  // 1/m; cells of 0.25 m: clamps
  ASSERT_FALSE(rest.beta_clamped.empty());
  EXPECT_TRUE(rest.tet(0).clamped);
  Eigen::VectorXd f(s.f_ext.size()), sum = Eigen::VectorXd::Zero(s.f_ext.size());
  Elements elements;
  elastic_forces(rest, s.mesh.tets, s.state.x, s.state.plastic_strain, kOne, elements, f);
  for (int t = 0; t < s.mesh.tet_count(); ++t) {
    const RestTet tet = rest.tet(t);
    const Mat34 x = gather(s.state.x, s.mesh.tets[t]);
    const Mat3 strain = corotational_strain(tet, x, elements.Q[t]) - s.state.plastic_strain[t];
    const Mat34 force = nodal_forces(tet, elements.Q[t], isotropic_stress(rest.lame, strain));
    for (int a = 0; a < 4; ++a) sum.segment<3>(3 * s.mesh.tets[t][a]) += force.col(a);
  }
  EXPECT_LT((f - sum).norm(), 1e-12 * f.norm());
  elastic_forces(rest, s.mesh.tets, s.mesh.X, test::rest_state(s.mesh).plastic_strain, kOne, elements, f);
  EXPECT_LT(f.norm(), 1e-8);
}

// yardstick S03: linear static cantilever; CalculiX's linear tets on the same mesh.
TEST(Assembly, StiffnessAgreesWithCalculiXOnS03) {
  CRUMPLE_NEED_SHARED("yardstick/S03_cantilever_small/L0.json");
  const auto level = test::read_json("yardstick/S03_cantilever_small/L0.json");
  TetMesh mesh;
  for (const auto& X : level["nodes"]) mesh.X.emplace_back(X[0], X[1], X[2]);
  for (const auto& t : level["tets"]) mesh.tets.push_back({t[0], t[1], t[2], t[3]});
  FemMaterial material;
  material.young = 1e7;
  const RestBody rest = test::rest_body(mesh, material);
  const FemState state = test::rest_state(mesh);

  Eigen::SparseMatrix<double> K =
      tangent_stiffness(rest, mesh.tets, state.x, state.plastic_strain, Tangent::fixed_rotation);
  Eigen::VectorXd f = Eigen::VectorXd::Zero(K.rows());
  for (const auto& load : level["loads"]) f.segment<3>(3 * load[0].get<int>()) += Vec3(load[1], load[2], load[3]);
  std::vector<char> fixed(K.rows(), 0);
  for (const auto& d : level["dirichlet"]) {
    ASSERT_EQ(d[2].get<double>(), 0);
    fixed[3 * d[0].get<int>() + d[1].get<int>()] = 1;
  }
  K.prune([&](Eigen::Index i, Eigen::Index j, double) { return i == j || (!fixed[i] && !fixed[j]); });
  for (Eigen::Index i = 0; i < f.size(); ++i)
    if (fixed[i]) f[i] = 0;
  linear_solver::Cholesky direct;
  ASSERT_TRUE(direct.factor(K));
  const Eigen::VectorXd u = direct.solve(f);
  double error = 0, norm = 0;
  const auto& reference = level["solutions"]["ccx_c3d4_linear"];
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const Vec3 ref(reference[i][0], reference[i][1], reference[i][2]);
    error += (u.segment<3>(3 * i) - ref).squaredNorm();
    norm += ref.squaredNorm();
  }
  EXPECT_LT(std::sqrt(error / norm), 1e-5);  // case.json; 7 digits are stored
}

}  // namespace
}  // namespace crumple::sim::fem
