#include "server/sim/fem/smoothed_octahedron.h"

#include "server/sim/fem/bdf2.h"
#include "server/sim/fem/rotation.h"
#include "tests/sim/fem/fem_test_support.h"

#include <numeric>
#include <set>

namespace crumple::sim::fem {
namespace {

const ThreadPool kOne(1);

constexpr ElementKind kSmoothed = ElementKind::smoothed_octahedra;
constexpr double kPatched = 0.49;  // Poisson's ratio of bodies with pressure patches

// A body of octahedra, moved at random, strained and flowed.
struct Shaken {
  TetMesh mesh;
  FemMaterial material;
  RestBody rest;
  FemState state;

  explicit Shaken(TetMesh made, std::span<const MaterialRegion> regions = {}, FlowRule flow = FlowRule::additive, double poisson = 0.3)
      : mesh(std::move(made)) {
    test::Random random;
    for (int t = 0; t < mesh.tet_count(); ++t) mesh.fill.push_back(random.uniform(0.1, 1));
    material.flow = flow;
    material.poisson = poisson;
    material.damping_mass = 0.7;
    material.damping_stiffness = 0.002;
    rest = test::rest_body(mesh, material, 0, regions, kSmoothed);
    state = test::rest_state(mesh);
    state.plastic_strain.assign(rest.point_count(), Mat3::Zero());
    const Mat3 R = random.rotation();
    for (Vec3& x : state.x) x = R * x + random.vec3(-0.008, 0.008);
    for (Vec3& v : state.v) v = random.vec3(-1, 1);
    for (Mat3& p : state.plastic_strain) p = 0.02 * symmetric_part(random.mat3(-1, 1));
  }

  Eigen::VectorXd forces(const std::vector<Vec3>& x) const {
    Elements elements;
    Eigen::VectorXd f(3 * mesh.node_count());
    elastic_forces(rest, mesh.tets, x, state.plastic_strain, kOne, elements, f);
    return f;
  }
  double energy(const std::vector<Vec3>& x) const { return elastic_energy(rest, mesh.tets, x, state.plastic_strain); }
};

std::vector<TetMesh> meshes() {
  return {test::bcc_box({4, 3, 3}, {1, 0.75, 0.75}), test::kuhn_box(4, 2, 2, {1, 0.5, 0.5})};
}

struct Case {
  TetMesh mesh;
  double poisson;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const TetMesh& mesh : meshes())
    for (const double poisson : {0.3, kPatched}) all.push_back({mesh, poisson});
  return all;
}

TEST(SmoothedOctahedron, TetsAroundLongEdgesOfABccLatticeAreHalfAsManyOctahedra) {
  const TetMesh mesh = test::bcc_box({6, 6, 6}, {1, 1, 1});
  const RestBody rest = test::rest_body(mesh, {}, 0, {}, kSmoothed);
  const MacroElements& o = rest.macros;
  // Around each edge between two centres, and around each edge of a cell that is inside: 5 * 6^2 and 6 * 5^2 an axis.
  // Those next to a face have the two halves of a pyramid beside them, which go by their own edges.
  EXPECT_GE(o.closed, 3 * 5 * 36 + 3 * 4 * 9);
  EXPECT_NEAR(std::accumulate(o.volume.begin(), o.volume.end(), 0.0), 1, 1e-12);
  std::vector<int> uses(mesh.tet_count(), 0);
  for (const int t : o.tets) ++uses[t];
  EXPECT_EQ(std::set(uses.begin(), uses.end()), std::set{2});
  for (int d = 0; d < o.closed; ++d) {
    EXPECT_EQ(o.corner_start[d + 1] - o.corner_start[d], 6);
    EXPECT_EQ(o.tet_start[d + 1] - o.tet_start[d], 4);
  }
}

// The patch test: an affine field strains all octahedra alike and pulls at no node inside.
TEST(SmoothedOctahedron, AnAffineFieldIsExact) {
  test::Random random(3);
  for (auto [mesh, poisson] : cases()) {
    std::set<int> surface;
    for (const SurfaceFace& face : surface_faces(mesh.tets)) surface.insert(face.nodes.begin(), face.nodes.end());
    for (int n = 0; n < mesh.node_count(); ++n)
      if (!surface.contains(n)) mesh.X[n] += random.vec3(-0.03, 0.03);
    FemMaterial material;
    material.poisson = poisson;
    const RestBody rest = test::rest_body(mesh, material, 0, {}, kSmoothed);
    const Mat3 F = random.rotation() * (Mat3::Identity() + 0.05 * symmetric_part(random.mat3(-1, 1)));
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.X) x.push_back(F * X + Vec3(1, 2, 3));
    const std::vector<Mat3> none(rest.point_count(), Mat3::Zero());
    Elements elements;
    Eigen::VectorXd f(3 * mesh.node_count());
    elastic_forces(rest, mesh.tets, x, none, kOne, elements, f);
    const Mat3 Q = rotation(F, RotationRule::svd);
    const Lame lame = lame_constants(material.young, poisson);
    const Mat3 sigma = isotropic_stress(lame, corotational_strain(Q, F)), own = isotropic_stress(rest.lame, corotational_strain(Q, F));
    for (const Mat3& s : elements.macros.sigma) EXPECT_LT((s - own).norm(), 1e-9 * own.norm());
    for (int n = 0; n < mesh.node_count(); ++n) {
      if (!surface.contains(n)) {
        EXPECT_LT(f.segment<3>(3 * n).norm(), 1e-9 * f.norm());
      }
    }
    const double volume = std::accumulate(rest.volume.begin(), rest.volume.end(), 0.0);
    const double energy = volume * energy_density(lame, corotational_strain(Q, F));
    EXPECT_NEAR(elastic_energy(rest, mesh.tets, x, none), energy, 1e-9 * energy);
    for (int t = 0; t < mesh.tet_count(); ++t)
      EXPECT_LT((element_stress(rest, elements, t) - Q * sigma * Q.transpose()).norm(), 1e-9 * sigma.norm());
  }
}

TEST(SmoothedOctahedron, ARigidMotionCostsNothing) {
  test::Random random(5);
  for (const TetMesh& mesh : meshes()) {
    Shaken s(mesh);
    s.state.plastic_strain.assign(s.rest.point_count(), Mat3::Zero());
    const Mat3 R = random.rotation();
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.X) x.push_back(R * X + Vec3(3, 2, 1));
    EXPECT_LT(s.energy(x), 1e-18);
    EXPECT_LT(s.forces(x).norm(), 1e-6);  // of E = 1e6 and rounded positions
  }
}

TEST(SmoothedOctahedron, ForceIsMinusEnergyGradientAndStiffnessMinusForceGradient) {
  for (const auto& [mesh, poisson] : cases()) {
    Shaken s(mesh, {}, FlowRule::additive, poisson);
    // With plastic strain that is not coaxial the paper's forces are no gradient: elastic here, balanced below.
    s.state.plastic_strain.assign(s.rest.point_count(), Mat3::Zero());
    const Eigen::VectorXd f = s.forces(s.state.x);
    const Eigen::MatrixXd K = tangent_stiffness(s.rest, s.mesh.tets, s.state.x, s.state.plastic_strain, Tangent::exact);
    EXPECT_LT((K - K.transpose()).norm(), 1e-12 * K.norm());
    constexpr double h = 1e-6;
    for (int dof = 0; dof < f.size(); dof += 7) {
      std::vector<Vec3> plus = s.state.x, minus = s.state.x;
      plus[dof / 3][dof % 3] += h;
      minus[dof / 3][dof % 3] -= h;
      EXPECT_NEAR(f[dof], -(s.energy(plus) - s.energy(minus)) / (2 * h), 1e-6 * f.norm());
      const Eigen::VectorXd column = -(s.forces(plus) - s.forces(minus)) / (2 * h);
      EXPECT_LT((column - K.col(dof)).norm(), 1e-6 * K.col(dof).norm());
    }
  }
}

TEST(SmoothedOctahedron, DeviatoricFlowLeavesForcesWithoutMoment) {
  for (const auto& [mesh, poisson] : cases()) {
    const Shaken s(mesh, {}, FlowRule::deviatoric, poisson);
    const Eigen::VectorXd f = s.forces(s.state.x);
    Vec3 moment = Vec3::Zero(), sum = Vec3::Zero();
    for (int n = 0; n < mesh.node_count(); ++n) {
      moment += s.state.x[n].cross(f.segment<3>(3 * n));
      sum += f.segment<3>(3 * n);
    }
    EXPECT_LT(moment.norm(), 1e-11 * f.norm());
    EXPECT_LT(sum.norm(), 1e-12 * f.norm());
  }
}

// Eq. 5 with whole matrices, of one material and of two, with tets that stand for themselves and without, with patches and without.
TEST(SmoothedOctahedron, AssembledSystemIsEquationFive) {
  for (const auto& [mesh, poisson] : cases()) {
    MaterialRegion region;
    region.material.young = 3e6;
    region.material.damping_mass = 0.1;
    region.material.damping_stiffness = 0.001;
    for (int t = 0; t < mesh.tet_count(); ++t)
      if (mesh.X[mesh.tets[t][0]].x() < 0.5) region.tets.push_back(t);
    for (const bool two : {false, true}) {
      for (const bool crushed : {false, true}) {
        Shaken s(mesh, two ? std::span<const MaterialRegion>(&region, 1) : std::span<const MaterialRegion>{}, FlowRule::additive, poisson);
        if (crushed) s.state.x[mesh.tets[20][0]] += 0.5 * (s.state.x[mesh.tets[20][1]] - s.state.x[mesh.tets[20][0]]) * 3;
        Elements elements;
        update_elements(s.rest, s.mesh.tets, s.state.x, s.state.plastic_strain, kOne, elements);
        EXPECT_EQ(elements.macros.any_split, crushed);
        constexpr double dt = 1.0 / 60;
        StepSystem system;
        const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * mesh.node_count());
        assemble(s.rest, s.mesh.tets, s.state, none, dt, {}, kOne, system);
        Eigen::VectorXd v(none.size()), b = dt * s.forces(s.state.x);
        for (int i = 0; i < mesh.node_count(); ++i) {
          v.segment<3>(3 * i) = s.state.v[i];
          b.segment<3>(3 * i) += s.rest.node_mass[i] * s.state.v[i];
        }
        EXPECT_LT((system.b - b).norm(), 1e-12 * b.norm());
        if (two) continue;
        const Eigen::MatrixXd K =
            tangent_stiffness(s.rest, s.mesh.tets, s.state.x, s.state.plastic_strain, Tangent::fixed_rotation);
        Eigen::MatrixXd A = (dt * s.material.damping_stiffness + dt * dt) * K;
        for (int i = 0; i < mesh.node_count(); ++i)
          A.diagonal().segment<3>(3 * i).array() += (1 + dt * s.material.damping_mass) * s.rest.node_mass[i];
        EXPECT_LT((system.to_sparse().toDense() - A).norm(), 1e-12 * A.norm());
      }
    }
  }
}

// Damping proportional to stiffness off in both: A = M + dt C + dt^2 K, K the sum of each material's.
TEST(SmoothedOctahedron, OfTwoMaterialsTheMatrixIsTheSumOfEach) {
  const TetMesh mesh = meshes().front();
  MaterialRegion region;
  for (int t = 0; t < mesh.tet_count(); t += 3) region.tets.push_back(t);
  region.material.damping_mass = 0.2;
  region.material.damping_stiffness = 0.004;
  region.material.young = 5e6;
  region.material.poisson = 0.45;
  const Shaken s(mesh, std::span(&region, 1), FlowRule::additive, 0.48);
  const Eigen::MatrixXd K = tangent_stiffness(s.rest, s.mesh.tets, s.state.x, s.state.plastic_strain, Tangent::fixed_rotation);
  RestBody undamped = s.rest;
  for (int k = 0; k < 2; ++k) undamped.material_at(k).damping_stiffness = 0;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * mesh.node_count());
  StepSystem system;
  assemble(undamped, s.mesh.tets, s.state, none, 0.01, {}, kOne, system);
  Eigen::MatrixXd A = 1e-4 * K;
  for (int i = 0; i < mesh.node_count(); ++i)
    A.diagonal().segment<3>(3 * i).array() += s.rest.node_mass[i] + 0.01 * s.rest.node_drag[i];
  EXPECT_LT((system.to_sparse().toDense() - A).norm(), 1e-12 * A.norm());
  // Neither octahedra nor patches reach from one material into the other.
  const MacroElements& o = s.rest.macros;
  for (int d = 0; d < o.count(); ++d)
    for (int k = o.tet_start[d]; k < o.tet_start[d + 1]; ++k)
      EXPECT_EQ(s.rest.material_id[o.tets[k]], s.rest.material_id[o.first_tet(d)]);
  const PressurePatches& patches = s.rest.patches;
  for (int p = 0; p < patches.count(); ++p)
    for (int k = patches.tet_start[p]; k < patches.tet_start[p + 1]; ++k)
      EXPECT_EQ(s.rest.material_id[patches.tets[k]], s.rest.material_id[patches.first_tet(p)]);
}

// Without the hourglass force the two lattices of a block slide through each other against its surface alone.
TEST(SmoothedOctahedron, TheTwoLatticesDoNotSlideThroughEachOther) {
  const TetMesh mesh = test::bcc_box({8, 8, 8}, {1, 1, 1});
  const std::vector<Mat3> none(mesh.tets.size(), Mat3::Zero());
  const RestBody tets = test::rest_body(mesh, {}), smoothed = test::rest_body(mesh, {}, 0, {}, kSmoothed);
  RestBody bare = smoothed;
  std::ranges::fill(bare.macros.gamma, 0.0);
  // What is far from the surface slides.
  std::vector<Vec3> x = mesh.X;
  for (Vec3& p : x) {
    const Vec3 scaled = 16 * p;
    const bool centre = std::lround(scaled.x()) % 2 == 1;
    if (centre && (p - Vec3::Constant(0.5)).cwiseAbs().maxCoeff() < 0.32) p += Vec3(0.002, 0.001, -0.001);
  }
  const double of_tets = elastic_energy(tets, mesh.tets, x, none);
  const double of_octahedra = elastic_energy(smoothed, mesh.tets, x, {none.begin(), none.begin() + smoothed.point_count()});
  const double of_averages = elastic_energy(bare, mesh.tets, x, {none.begin(), none.begin() + smoothed.point_count()});
  EXPECT_GT(of_octahedra - of_averages, 0.5 * kHourglassShare * of_tets);
  EXPECT_LT(of_octahedra - of_averages, 2 * kHourglassShare * of_tets);
}

// What the multigrid's smoother takes for granted (islands/composite_multigrid.cpp).
TEST(SmoothedOctahedron, NoEigenvalueIsAboveTheSpectralBound) {
  for (const TetMesh& mesh : meshes()) {
    for (const double poisson : {0.0, 0.3, 0.4, 0.45, 0.49, 0.4999}) {
      FemMaterial material;
      material.poisson = poisson;
      const RestBody rest = test::rest_body(mesh, material, 0, {}, kSmoothed);
      FemState state = test::rest_state(mesh);
      state.plastic_strain.assign(rest.point_count(), Mat3::Zero());
      StepSystem system;
      assemble(rest, mesh.tets, state, Eigen::VectorXd::Zero(3 * mesh.node_count()), 10, {}, kOne, system);  // stiffness alone
      const Eigen::MatrixXd A = system.to_sparse().toDense();
      Eigen::MatrixXd D = Eigen::MatrixXd::Zero(A.rows(), A.cols());
      for (int i = 0; i < mesh.node_count(); ++i) D.block<3, 3>(3 * i, 3 * i) = system.diagonal()[i];
      const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A, D, Eigen::EigenvaluesOnly);
      EXPECT_LT(eigen.eigenvalues().maxCoeff(), system.spectral_bound) << mesh.tet_count() << " tets, nu " << poisson;
      EXPECT_GT(eigen.eigenvalues().maxCoeff(), (rest.patches.empty() ? 0.4 : 0.3) * system.spectral_bound);
    }
  }
}

TEST(SmoothedOctahedron, ACantileverBendsAsItShouldOnACoarseMesh) {
  for (const bool bcc : {true, false}) {
    const double plain = test::cantilever_tip(bcc, {}, ElementKind::linear_tetrahedra) - 1, smoothed = test::cantilever_tip(bcc, {}, kSmoothed) - 1;
    // Measured: BCC -12.7 % and -6.0 %, Kuhn -31 % and -5 %; on finer meshes the ratio grows (docs/lab.md).
    EXPECT_LT(std::abs(smoothed), 0.065) << "bcc " << bcc << ", plain " << plain;
    EXPECT_LT(std::abs(smoothed), (bcc ? 0.5 : 0.2) * std::abs(plain)) << "bcc " << bcc;
  }
}

TEST(SmoothedOctahedron, ACrackPartsThemAndPlasticStrainGoesOn) {
  TetMesh mesh = test::bcc_box({4, 4, 4}, {1, 1, 1});
  RestBody rest = test::rest_body(mesh, {}, 0, {}, kSmoothed);
  const double volume = std::accumulate(rest.macros.volume.begin(), rest.macros.volume.end(), 0.0);
  const MacroElements before = rest.macros;
  // The plane x = 1/2 parts the mesh between the tets on either side of it, by centroid.
  std::vector<Tet> tets = mesh.tets;
  std::map<int, int> copy;
  for (Tet& tet : tets) {
    double x = 0;
    for (const int n : tet) x += mesh.X[n].x() / 4;
    if (x < 0.5) continue;
    for (int& n : tet) n = copy.emplace(n, mesh.node_count() + static_cast<int>(copy.size())).first->second;
  }
  const std::vector<int> parents = follow_topology(rest, tets, mesh.node_count() + static_cast<int>(copy.size()));
  const MacroElements& after = rest.macros;
  ASSERT_EQ(static_cast<int>(parents.size()), after.count());
  EXPECT_GT(after.count(), before.count());
  EXPECT_NEAR(std::accumulate(after.volume.begin(), after.volume.end(), 0.0), volume, 1e-12);
  for (int d = 0; d < after.count(); ++d) {
    std::set<bool> sides;
    for (int k = after.tet_start[d]; k < after.tet_start[d + 1]; ++k) {
      const int t = after.tets[k];
      sides.insert(tets[t] != mesh.tets[t]);
      const auto of_before = std::span(before.tets).subspan(before.tet_start[parents[d]], before.tet_start[parents[d] + 1] - before.tet_start[parents[d]]);
      EXPECT_TRUE(std::ranges::count(of_before, t) == 1);
    }
    EXPECT_EQ(sides.size(), 1u);
  }
}

// A bar pulled past yield: all octahedra flow alike, as a plain tet does.
TEST(SmoothedOctahedron, FlowsAsAPlainTetWhereStrainIsUniform) {
  for (const TetMesh& mesh : meshes()) {
    FemMaterial material;
    material.flow = FlowRule::deviatoric;
    material.yield = 0.01;
    material.creep = 0.5;
    const Mat3 F = Mat3::Identity() + 0.1 * Vec3::UnitX() * Vec3::UnitX().transpose();
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.X) x.push_back(F * X);
    const auto flowed = [&](ElementKind element) {
      const RestBody rest = test::rest_body(mesh, material, 0, {}, element);
      std::vector<Mat3> plastic(rest.point_count(), Mat3::Zero());
      Elements elements;
      for (int k = 0; k < 5; ++k) plastic_flow(rest, mesh.tets, x, 1.0 / 60, 1.0 / 60, kOne, plastic, elements);
      return plastic;
    };
    const Mat3 expected = flowed(ElementKind::linear_tetrahedra).front();
    EXPECT_GT(expected.norm(), 0.01);
    for (const Mat3& p : flowed(kSmoothed)) EXPECT_LT((p - expected).norm(), 1e-12);
  }
}

// A sliver whose basis is clamped stands for itself: at rest it has no strain, does not flow and does not push.
TEST(SmoothedOctahedron, AClampedSliverStaysAtRest) {
  const TetMesh mesh = test::kuhn_box(2, 2, 2, {1, 1, 1});
  FemMaterial material;
  material.yield = 0.002;
  material.creep = 1;
  // The inverse of the shortest height of these tets is 2 sqrt(2): all are clamped at 2.
  const RestBody rest = test::rest_body(mesh, material, 2, {}, kSmoothed);
  ASSERT_FALSE(rest.beta_clamped.empty());
  std::vector<Mat3> plastic(rest.point_count(), Mat3::Zero());
  Elements elements;
  plastic_flow(rest, mesh.tets, mesh.X, 1.0 / 60, 1.0 / 60, kOne, plastic, elements);
  for (const Mat3& p : plastic) EXPECT_TRUE(p.isZero(1e-15));
  Eigen::VectorXd f(3 * mesh.node_count());
  elastic_forces(rest, mesh.tets, mesh.X, plastic, kOne, elements, f);
  EXPECT_LT(f.norm(), 1e-9);
  // Moved, all of its tets alone, the body does as one of clamped plain tets.
  std::vector<Vec3> x;
  for (const Vec3& X : mesh.X) x.push_back(1.01 * X);
  Elements of_tets;
  Eigen::VectorXd plain(f.size());
  elastic_forces(rest, mesh.tets, x, plastic, kOne, elements, f);
  elastic_forces(test::rest_body(mesh, material, 2), mesh.tets, x, std::vector<Mat3>(mesh.tets.size(), Mat3::Zero()), kOne, of_tets, plain);
  EXPECT_GT(plain.norm(), 1);
  EXPECT_LT((f - plain).norm(), 1e-12 * plain.norm());
}

TEST(SmoothedOctahedron, SameBitsForOneAndTwoThreads) {
  const ThreadPool two(2);
  for (const auto& [bdf2, poisson] : {std::pair{false, 0.3}, {true, 0.3}, {false, kPatched}, {true, kPatched}}) {
    std::vector<std::vector<Vec3>> ends;
    for (const ThreadPool* pool : {&kOne, &two}) {
      Shaken s(test::bcc_box({8, 4, 4}, {2, 1, 1}), {}, FlowRule::additive, poisson);
      StepScratch scratch;
      Bdf2Scratch bdf2_scratch;
      const Eigen::VectorXd f = test::gravity_force(s.rest, {0, -9.81, 0});
      for (int k = 0; k < 10; ++k) {
        const StepOptions options = step_options(s.material, 1.0 / 60);
        if (bdf2) bdf2_step(s.rest, s.mesh.tets, s.state, f, {}, options, *pool, scratch, bdf2_scratch);
        else implicit_euler_step(s.rest, s.mesh.tets, s.state, f, {}, options, *pool, scratch);
      }
      ends.push_back(s.state.x);
    }
    EXPECT_EQ(ends[0], ends[1]);
  }
}

}  // namespace
}  // namespace crumple::sim::fem
