// Bodies of several materials against closed forms.
#include "server/sim/fem/material_region.h"

#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/rotation.h"
#include "server/sim/linear_solver/cholesky.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

const ThreadPool kOne(1);

Vec3 centroid(const TetMesh& mesh, int t) {
  const Mat34 X = gather(mesh.X, mesh.tets[t]);
  return X.rowwise().mean();
}

template <class Predicate>
std::vector<int> tets_where(const TetMesh& mesh, Predicate holds) {
  std::vector<int> tets;
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (holds(centroid(mesh, t))) tets.push_back(t);
  return tets;
}

RestBody rest_body_of(const TetMesh& mesh, const FemMaterial& material, const std::vector<MaterialRegion>& regions,
                      double clamp_limit = 0) {
  Result<RestBody> rest = make_rest_body(mesh, material, clamp_limit, regions);
  EXPECT_TRUE(rest) << rest.error().text();
  return std::move(*rest);
}

FemMaterial elastic(double young, double poisson, double density = 1000) {
  return {.young = young, .poisson = poisson, .density = density};
}

Eigen::SparseMatrix<double> stiffness_at_rest(const RestBody& rest, const TetMesh& mesh) {
  const FemState state = test::rest_state(mesh);
  return tangent_stiffness(rest, mesh.tets, state.x, state.plastic_strain, Tangent::fixed_rotation);
}

// Displacements for which K u = f where a dof is free and u is as given where it is fixed.
Eigen::VectorXd solve_static(Eigen::SparseMatrix<double> K, const Eigen::VectorXd& f, const std::vector<char>& fixed,
                             const Eigen::VectorXd& given) {
  Eigen::VectorXd known = given;
  for (Eigen::Index i = 0; i < known.size(); ++i)
    if (!fixed[i]) known[i] = 0;
  Eigen::VectorXd rhs = f - K * known;
  K.prune([&](Eigen::Index i, Eigen::Index j, double) { return i == j || (!fixed[i] && !fixed[j]); });
  for (Eigen::Index i = 0; i < rhs.size(); ++i)
    if (fixed[i]) rhs[i] = 0;
  linear_solver::Cholesky direct;
  EXPECT_TRUE(direct.factor(K));
  return direct.solve(rhs) + known;
}

// ---- closed forms --------------------------------------------------------------------------------------------------
TEST(Materials, MassIsTheSumOverTheRegions) {
  TetMesh mesh = test::kuhn_box(4, 2, 3, {2, 1, 0.5});
  const auto left = tets_where(mesh, [](const Vec3& p) { return p.x() < 0.5; });
  const RestBody rest = rest_body_of(mesh, elastic(1e6, 0.3, 1200), {{left, elastic(1e9, 0.3, 7800)}});
  EXPECT_NEAR(rest.mass(), 7800 * 0.25 + 1200 * 0.75, 1e-9);
  EXPECT_EQ(rest.material_count(), 2);

  mesh.fill.assign(mesh.tets.size(), 0.5);
  RestBody half = rest_body_of(mesh, elastic(1e6, 0.3, 1200), {{left, elastic(1e9, 0.3, 7800)}});
  EXPECT_NEAR(half.mass(), rest.mass() / 2, 1e-9);
  follow_topology(half, mesh.tets, mesh.node_count());
  EXPECT_NEAR(half.mass(), rest.mass() / 2, 1e-9);
}

// Springs in series: u = F / A (L1 / E1 + L2 / E2). Linear tets hold the piecewise linear solution exactly.
TEST(Materials, ABarOfTwoHalvesStretchesLikeSpringsInSeries) {
  const TetMesh mesh = test::kuhn_box(6, 2, 2, {3, 1, 0.5});
  const auto right = tets_where(mesh, [](const Vec3& p) { return p.x() > 1; });
  const double E1 = 1e6, E2 = 2e7, traction = 5e3;
  const RestBody rest = rest_body_of(mesh, elastic(E1, 0), {{right, elastic(E2, 0)}});
  Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * mesh.node_count());
  for (const SurfaceFace& face : surface_faces(mesh.tets)) {
    const Vec3 &a = mesh.X[face.nodes[0]], &b = mesh.X[face.nodes[1]], &c = mesh.X[face.nodes[2]];
    if (std::min({a.x(), b.x(), c.x()}) < 3) continue;
    for (int n : face.nodes) f[3 * n] += traction * (b - a).cross(c - a).norm() / 6;
  }
  std::vector<char> fixed(f.size(), 0);
  for (int n = 0; n < mesh.node_count(); ++n)
    if (mesh.X[n].x() == 0) fixed[3 * n] = fixed[3 * n + 1] = fixed[3 * n + 2] = 1;
  const Eigen::VectorXd u = solve_static(stiffness_at_rest(rest, mesh), f, fixed, Eigen::VectorXd::Zero(f.size()));
  for (int n = 0; n < mesh.node_count(); ++n) {
    const double x = mesh.X[n].x();
    const double expected = traction / E1 * std::min(x, 1.0) + traction / E2 * std::max(x - 1, 0.0);
    EXPECT_LT((Vec3(u.segment<3>(3 * n)) - Vec3(expected, 0, 0)).norm(), 1e-12) << n;
  }
}

// Springs in parallel: F = (E1 A1 + E2 A2) e.
TEST(Materials, ABarOfTwoLayersPullsLikeSpringsInParallel) {
  const TetMesh mesh = test::kuhn_box(3, 4, 2, {1.5, 1, 0.5});
  const auto layer = tets_where(mesh, [](const Vec3& p) { return p.y() < 0.25; });
  const double E1 = 1e6, E2 = 3e8, e = 0.02;
  const RestBody rest = rest_body_of(mesh, elastic(E1, 0), {{layer, elastic(E2, 0)}});
  FemState state = test::rest_state(mesh);
  for (Vec3& x : state.x) x.x() *= 1 + e;
  Elements elements;
  Eigen::VectorXd f(3 * mesh.node_count());
  elastic_forces(rest, mesh.tets, state.x, state.plastic_strain, kOne, elements, f);
  double pull = 0;
  for (int n = 0; n < mesh.node_count(); ++n) {
    if (mesh.X[n].x() == 1.5) pull -= f[3 * n];
  }
  EXPECT_NEAR(pull, (E1 * 0.75 + E2 * 0.25) * 0.5 * e, 1e-9 * pull);
  // 1/2 E e^2 of each layer's volume; both ways of summing it
  const double energy = 0.5 * e * e * 1.5 * 0.5 * (E1 * 0.75 + E2 * 0.25);
  EXPECT_NEAR(elastic_energy(rest, mesh.tets, state.x, state.plastic_strain), energy, 1e-9 * energy);
  EXPECT_NEAR(elastic_energy(rest, elements), energy, 1e-9 * energy);
}

// Two halves bonded at x = 1/2. Any uniform gradient A1 in the first goes with A2 = A1 + a n^T in the second, a from
// sigma1 n = sigma2 n (Hadamard's jump, continuous traction). Linear tets must hold it: the patch test of two materials.
TEST(Materials, PatchOfTwoMaterialsHasContinuousTraction) {
  const TetMesh mesh = test::kuhn_box(4, 3, 3, {1, 1, 1});
  const auto right = tets_where(mesh, [](const Vec3& p) { return p.x() > 0.5; });
  const FemMaterial soft = elastic(1e6, 0.2), stiff = elastic(5e7, 0.4);
  const RestBody rest = rest_body_of(mesh, soft, {{right, stiff}});
  const Lame l1 = rest.lame, l2 = rest.others[0].lame;
  const Mat3 A1 = 1e-6 * test::Random(3).mat3(-1, 1);
  const Vec3 n = Vec3::UnitX();
  const Vec3 traction = isotropic_stress(l1, symmetric_part(A1)) * n;
  // The traction of a n^T in material 2: (lambda + mu) (a . n) n + mu a
  const Mat3 acoustic = (l2.lambda + l2.mu) * n * n.transpose() + l2.mu * Mat3::Identity();
  const Vec3 a = acoustic.inverse() * (traction - isotropic_stress(l2, symmetric_part(A1)) * n);
  const Mat3 A2 = A1 + a * n.transpose();
  EXPECT_LT((isotropic_stress(l2, symmetric_part(A2)) * n - traction).norm(), 1e-12 * traction.norm());

  Eigen::VectorXd expected(3 * mesh.node_count());
  std::vector<char> fixed(expected.size(), 0);
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Vec3& X = mesh.X[i];
    expected.segment<3>(3 * i) = A1 * X + std::max(X.x() - 0.5, 0.0) * a;
    if (X.minCoeff() > 1e-9 && X.maxCoeff() < 1 - 1e-9) continue;
    fixed[3 * i] = fixed[3 * i + 1] = fixed[3 * i + 2] = 1;
  }
  const Eigen::VectorXd u = solve_static(stiffness_at_rest(rest, mesh), Eigen::VectorXd::Zero(expected.size()), fixed, expected);
  EXPECT_LT((u - expected).norm(), 1e-12 * expected.norm());

  // The same seen by the step's own elements.
  FemState state = test::rest_state(mesh);
  for (int i = 0; i < mesh.node_count(); ++i) state.x[i] += expected.segment<3>(3 * i);
  Elements elements;
  update_elements(rest, mesh.tets, state.x, state.plastic_strain, kOne, elements);
  for (int t = 0; t < mesh.tet_count(); ++t)
    EXPECT_LT((element_stress(rest, elements, t) * n - traction).norm(), 1e-4 * traction.norm());  // strain of 1e-6: rotation
}

// ---- the step ------------------------------------------------------------------------------------------------------
struct Sandwich {
  TetMesh mesh = test::kuhn_box(4, 3, 2, {1, 0.75, 0.5});
  FemMaterial body = elastic(1e6, 0.3);
  std::vector<MaterialRegion> regions;
  FemState state;
  Eigen::VectorXd f_ext;

  Sandwich() {
    body.damping_mass = 0.7;
    body.damping_stiffness = 0.002;
    FemMaterial stiff = elastic(2e8, 0.1, 7800), light = elastic(3e4, 0.45, 50);
    stiff.damping_stiffness = 0.0003;
    light.damping_mass = 4;
    regions = {{tets_where(mesh, [](const Vec3& p) { return p.x() < 0.25; }), stiff},
               {tets_where(mesh, [](const Vec3& p) { return p.x() > 0.6 && p.y() > 0.5; }), light}};
    test::Random random;
    state = test::rest_state(mesh);
    const Mat3 R = random.rotation();
    for (Vec3& x : state.x) x = R * x + random.vec3(-0.02, 0.02);
    for (Vec3& v : state.v) v = random.vec3(-1, 1);
    for (Mat3& p : state.plastic_strain) p = 0.02 * symmetric_part(random.mat3(-1, 1));
    f_ext = Eigen::VectorXd::NullaryExpr(3 * mesh.node_count(), [&] { return random.uniform(-5, 5); });
  }
};

// M, C and K summed tet by tet, each with its own material, as equation five of whole matrices.
TEST(Materials, AssemblyWeighsEveryTetWithItsOwnMaterial) {
  const Sandwich s;
  const RestBody rest = rest_body_of(s.mesh, s.body, s.regions);
  const double dt = 1.0 / 60;
  StepSystem system;
  assemble(rest, s.mesh.tets, s.state, s.f_ext, dt, {}, kOne, system);

  const Eigen::Index n = s.f_ext.size();
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n), C = M, K = M;
  Eigen::VectorXd f = Eigen::VectorXd::Zero(n), v(n);
  for (int t = 0; t < s.mesh.tet_count(); ++t) {
    const FemMaterial* m = &s.body;
    for (const MaterialRegion& region : s.regions)
      if (std::ranges::find(region.tets, t) != region.tets.end()) m = &region.material;
    const Lame lame = lame_constants(m->young, m->poisson);
    const RestTet tet = rest.tet(t);
    const Mat34 x = gather(s.state.x, s.mesh.tets[t]);
    const Mat3 Q = svd_rotation(deformation_gradient(x, tet.beta));
    const Mat34 force = nodal_forces(tet, Q, isotropic_stress(lame, corotational_strain(tet, x, Q) - s.state.plastic_strain[t]));
    for (int a = 0; a < 4; ++a) {
      const int i = 3 * s.mesh.tets[t][a];
      f.segment<3>(i) += force.col(a);
      const Mat3 mass = m->density * tet.volume / 4 * Mat3::Identity();
      M.block<3, 3>(i, i) += mass;
      C.block<3, 3>(i, i) += m->damping_mass * mass;
      for (int b = 0; b < 4; ++b) {
        const Mat3 block = stiffness_block(tet, lame, Q, a, b);
        K.block<3, 3>(i, 3 * s.mesh.tets[t][b]) += block;
        C.block<3, 3>(i, 3 * s.mesh.tets[t][b]) += m->damping_stiffness * block;
      }
    }
  }
  for (int i = 0; i < rest.node_count(); ++i) v.segment<3>(3 * i) = s.state.v[i];
  const Eigen::MatrixXd A = M + dt * C + dt * dt * K;
  EXPECT_LT((system.to_sparse().toDense() - A).norm(), 1e-13 * A.norm());
  const Eigen::VectorXd b = dt * (s.f_ext + f) + M * v;
  EXPECT_LT((system.b - b).norm(), 1e-13 * b.norm());
  const Eigen::MatrixXd tangent =
      tangent_stiffness(rest, s.mesh.tets, s.state.x, s.state.plastic_strain, Tangent::fixed_rotation);
  EXPECT_LT((tangent - K).norm(), 1e-13 * K.norm());
}

TEST(Materials, RegionsOfTheBodysOwnMaterialChangeNothing) {
  Sandwich s;
  for (MaterialRegion& region : s.regions) region.material = s.body;
  const RestBody one = rest_body_of(s.mesh, s.body, {}), several = rest_body_of(s.mesh, s.body, s.regions);
  StepSystem a, b;
  assemble(one, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, a);
  assemble(several, s.mesh.tets, s.state, s.f_ext, 1.0 / 60, {}, kOne, b);
  EXPECT_LT((a.to_sparse() - b.to_sparse()).norm(), 1e-14 * a.to_sparse().norm());
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(one.node_mass, several.node_mass);
}

TEST(Materials, SameBitsForOneAndTwoThreads) {
  const Sandwich s;
  FemMaterial metal = s.body;
  metal.yield = 0.01;
  metal.creep = 0.5;
  const RestBody rest = rest_body_of(s.mesh, metal, s.regions);
  FemState one = s.state, two = s.state;
  StepScratch scratch_one, scratch_two;
  const StepOptions options = step_options(metal, 1.0 / 120);
  const ThreadPool pool(2);
  for (int k = 0; k < 5; ++k) {
    implicit_euler_step(rest, s.mesh.tets, one, s.f_ext, {}, options, kOne, scratch_one);
    implicit_euler_step(rest, s.mesh.tets, two, s.f_ext, {}, options, pool, scratch_two);
  }
  EXPECT_EQ(one.x, two.x);
  EXPECT_EQ(one.v, two.v);
  EXPECT_EQ(one.plastic_strain, two.plastic_strain);
}

TEST(Materials, EachTetFlowsByItsOwnRule) {
  const TetMesh mesh = test::kuhn_box(6, 1, 1, {3, 0.5, 0.5});
  FemMaterial brittle = elastic(1e6, 0.3), metal = brittle, putty = brittle;
  metal.yield = 0.01;
  metal.creep = 1;
  metal.flow = FlowRule::deviatoric;
  putty.yield = 0.02;
  putty.creep = 0.25;
  putty.max_plastic = 0.01;
  putty.raw_creep = true;
  const auto third = [&](int k) {
    return tets_where(mesh, [=](const Vec3& p) { return std::floor(p.x()) == k; });
  };
  const RestBody rest = rest_body_of(mesh, brittle, {{third(1), metal}, {third(2), putty}});
  FemState state = test::rest_state(mesh);
  for (Vec3& x : state.x) x.x() *= 1.05;
  Elements elements;
  plastic_flow(rest, mesh.tets, state.x, 1.0 / 240, 1.0 / 60, kOne, state.plastic_strain, elements);
  const Mat3 strain = Vec3(0.05, 0, 0).asDiagonal();
  Mat3 of_metal = Mat3::Zero(), of_putty = Mat3::Zero();
  flow(FlowRule::deviatoric, strain, 0.01, 1, 0.3, of_metal);
  flow(FlowRule::additive, strain, 0.02, 0.25, 0.01, of_putty);
  EXPECT_NEAR(of_putty.norm(), 0.0075, 1e-15);
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const int k = static_cast<int>(centroid(mesh, t).x());
    const Mat3& expected = k == 0 ? Mat3::Zero().eval() : k == 1 ? of_metal : of_putty;
    EXPECT_LT((state.plastic_strain[t] - expected).norm(), 1e-14) << t;
    const Mat3 sigma = isotropic_stress(rest.lame_of(t), strain - state.plastic_strain[t]);
    EXPECT_LT((elements.sigma[t] - sigma).norm(), 1e-6) << t;
  }
}

// A region may ask for the paper's rotation rule where its neighbours have the default one.
TEST(Materials, EachTetTurnsByItsOwnRule) {
  const TetMesh mesh = test::kuhn_box(2, 1, 1, {2, 1, 1});
  FemMaterial paper = elastic(1e6, 0.3);
  paper.rotation = RotationRule::polar_qr;
  const RestBody rest = rest_body_of(mesh, elastic(1e6, 0.3), {{tets_where(mesh, [](const Vec3& p) { return p.x() > 1; }), paper}});
  Mat3 squeeze;
  squeeze << 0.1, 0.3, 0, 0, 0.4, 0.2, 0, 0, 0.5;
  FemState state = test::rest_state(mesh);
  for (Vec3& x : state.x) x = squeeze * x;
  Elements elements;
  update_elements(rest, mesh.tets, state.x, state.plastic_strain, kOne, elements);
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Mat3 Q = centroid(mesh, t).x() > 1 ? rotation(squeeze, RotationRule::polar_qr) : svd_rotation(squeeze);
    EXPECT_LT((elements.Q[t] - Q).norm(), 1e-12) << t;
  }
  EXPECT_GT((rotation(squeeze, RotationRule::polar_qr) - svd_rotation(squeeze)).norm(), 0.1);
}

// ---- bad input -----------------------------------------------------------------------------------------------------
TEST(Materials, BadRegionsAreNamedErrors) {
  const TetMesh mesh = test::kuhn_box(1, 1, 1, {1, 1, 1});
  const FemMaterial m = elastic(1e6, 0.3);
  const auto error = [&](const std::vector<MaterialRegion>& regions) {
    const auto rest = make_rest_body(mesh, m, 0, regions);
    return rest ? std::string("none") : rest.error().text();
  };
  EXPECT_EQ(error({{{0, 3}, m}, {{5}, m}}), "none");
  EXPECT_EQ(error({{{0}, m}, {{}, m}}), "regions[1].tets is empty, must select one tet at least");
  EXPECT_EQ(error({{{0, 6}, m}}), "regions[0].tets names tet 6, must be below the mesh's 6 tets");
  EXPECT_EQ(error({{{-1}, m}}), "regions[0].tets names tet -1, must be below the mesh's 6 tets");
  EXPECT_EQ(error({{{0, 1}, m}, {{1}, m}}), "regions[1].tets names tet 1 again, must name a tet once");
  EXPECT_EQ(error({{{0}, elastic(-1, 0.3)}}), "regions[0].material.young is -1, must be in (0, 1e13] Pa");
  FemMaterial slippery = m;
  slippery.friction = 0.1;
  EXPECT_EQ(error({{{0}, slippery}}), "regions[0].material.friction is 0.1, must be that of the body's material (0.4)");
  FemMaterial eager = m;
  eager.fracture_interval = 7;
  EXPECT_EQ(error({{{0}, eager}}),
            "regions[0].material.fracture_interval is 7, must be that of the body's material (1)");
  copy_whole_body_fields(m, eager);
  EXPECT_EQ(error({{{0}, eager}}), "none");
  EXPECT_EQ(error(std::vector<MaterialRegion>(1001, {{0}, m})), "regions has 1001 entries, must have at most 1000");
}

}  // namespace
}  // namespace crumple::sim::fem
