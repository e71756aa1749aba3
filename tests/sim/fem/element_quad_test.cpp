#include "server/sim/fem/element_quad.h"

#include "server/sim/fem/rotation.h"
#include "tests/sim/fem/fem_test_support.h"

namespace crumple::sim::fem {
namespace {

// Rotated, sheared and shaken, with plastic strain and fill; 96 tets.
struct Shaken {
  TetMesh mesh = test::kuhn_box(4, 2, 2, {1, 0.5, 0.5});
  FemState state;

  explicit Shaken(double shake) {
    test::Random random;
    state = test::rest_state(mesh);
    const Mat3 A = random.rotation() * (Mat3::Identity() + 0.2 * random.mat3(-1, 1));
    for (Vec3& x : state.x) x = A * x + random.vec3(-shake, shake);
    for (Mat3& p : state.plastic_strain) p = 0.02 * symmetric_part(random.mat3(-1, 1));
    for (int t = 0; t < mesh.tet_count(); ++t) mesh.fill.push_back(random.uniform(0.1, 1));
  }
};

// All tets from `first` on, by fours; their energy in chunk_energy[0].
Elements by_fours(const Shaken& body, const RestBody& rest, int first) {
  Elements elements;
  elements.resize(rest.tet_count());
  double& energy = elements.chunk_energy[0];
  for (int t = first; t + 4 <= rest.tet_count(); t += 4)
    EXPECT_TRUE(update_element_quad(rest, body.mesh.tets, t, body.state.x, body.state.plastic_strain, elements, energy));
  return elements;
}

TEST(ElementQuad, EqualsTheFormulasOfOneTet) {
  const Shaken body(0.02);
  const RestBody rest = test::rest_body(body.mesh, FemMaterial{}, 1e9);
  const Elements elements = by_fours(body, rest, 0);
  for (int t = 0; t < rest.tet_count(); ++t) {
    const Mat34 x = gather(body.state.x, body.mesh.tets[t]);
    const RestTet tet = rest.tet(t);
    const Mat3 F = deformation_gradient(x, tet.beta), Q = svd_rotation(F);
    const Mat3 sigma = isotropic_stress(rest.lame, corotational_strain(Q, F) - body.state.plastic_strain[t]);
    EXPECT_LT((elements.Q[t] - Q).norm(), 1e-13);
    EXPECT_LT((elements.sigma[t] - sigma).norm(), 1e-12 * sigma.norm());
    const Mat34 force = nodal_forces(tet, Q, sigma);
    EXPECT_LT((elements.force[t] - force).norm(), 1e-12 * force.norm());
    EXPECT_LT((elements.core[t] - Q * rest.core(t)).norm(), 1e-13 * rest.core(t).norm());
  }
  const double energy = elastic_energy(rest, body.mesh.tets, body.state.x, body.state.plastic_strain);
  ASSERT_EQ(rest.tet_count() % 4, 0);
  EXPECT_NEAR(elements.chunk_energy[0], energy, 1e-12 * energy);
}

TEST(ElementQuad, LeavesWhatIsNearlySingularToTheOthers) {
  Shaken body(0.0);
  const RestBody rest = test::rest_body(body.mesh, FemMaterial{}, 1e9);
  Elements elements;
  elements.resize(rest.tet_count());
  double energy = 0;
  for (Vec3& x : body.state.x) x.z() = 0;  // flat
  EXPECT_FALSE(update_element_quad(rest, body.mesh.tets, 0, body.state.x, body.state.plastic_strain, elements, energy));
  for (Vec3& x : body.state.x) x = Vec3(-x.x(), x.y(), x.x());
  EXPECT_FALSE(update_element_quad(rest, body.mesh.tets, 4, body.state.x, body.state.plastic_strain, elements, energy));
  body.state.x[3] = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  for (int t = 0; t + 4 <= rest.tet_count(); t += 4)
    EXPECT_FALSE(update_element_quad(rest, body.mesh.tets, t, body.state.x, body.state.plastic_strain, elements, energy));
}

// In every lane, and in the tail that fills none.
TEST(ElementQuad, InvertedTetsAreCountedWhereverTheyStand) {
  Shaken body(0.3);
  std::vector<int> of_lane(5, 0);  // the tail last
  for (const std::size_t tets : {96u, 95u, 94u, 93u, 3u, 1u}) {
    body.mesh.tets.resize(tets);
    body.mesh.fill.resize(tets);
    int count = 0;
    for (std::size_t t = 0; t < tets; ++t) {
      const bool inverted = edge_matrix(gather(body.state.x, body.mesh.tets[t])).determinant() < 0;
      count += inverted;
      of_lane[t < tets / 4 * 4 ? t % 4 : 4] += inverted;
    }
    EXPECT_EQ(inverted_count(body.mesh.tets, body.state.x, ThreadPool(1)), count);
    Elements elements;
    const std::vector<Mat3> unstrained(tets, Mat3::Zero());
    update_elements(test::rest_body(body.mesh, FemMaterial{}, 1e9), body.mesh.tets, body.state.x, unstrained, ThreadPool(1), elements);
    EXPECT_EQ(inverted_count(elements), count);
  }
  for (const int lane : of_lane) EXPECT_GT(lane, 0);
}

// Several materials in the lanes: constants, rotation rule and the moment's balance are each tet's own.
TEST(ElementQuad, LanesHaveTheirOwnMaterials) {
  Shaken body(0.02);
  FemMaterial soft, metal{.young = 3e8, .poisson = 0.1}, paper{.young = 2e7, .rotation = RotationRule::polar_qr};
  metal.flow = FlowRule::deviatoric;
  MaterialRegion of_metal{{}, metal}, of_paper{{}, paper};
  for (int t = 0; t < body.mesh.tet_count(); ++t) {
    if (t % 3 == 1) of_metal.tets.push_back(t);
    if (t % 5 == 3 && t % 3 != 1) of_paper.tets.push_back(t);
    if (t % 7 == 0) body.state.plastic_strain[t].setZero();
  }
  const auto made = make_rest_body(body.mesh, soft, 1e9, std::vector{of_metal, of_paper});
  ASSERT_TRUE(made);
  const RestBody& rest = *made;
  Elements elements = by_fours(body, rest, 0);
  for (int t = 0; t < rest.tet_count(); ++t) {
    const Mat34 x = gather(body.state.x, body.mesh.tets[t]);
    const RestTet tet = rest.tet(t);
    const FemMaterial& m = t % 3 == 1 ? metal : t % 5 == 3 ? paper : soft;
    const Mat3 F = deformation_gradient(x, tet.beta), Q = svd_rotation(F);
    const Mat3 sigma = isotropic_stress(lame_constants(m.young, m.poisson),
                                        corotational_strain(Q, F) - body.state.plastic_strain[t]);
    EXPECT_LT((elements.sigma[t] - sigma).norm(), 1e-12 * sigma.norm());
    Mat3 stress = sigma;
    if (m.flow == FlowRule::deviatoric && t % 7 != 0) {
      stress += moment_balance(symmetric_part(Q.transpose() * F), sigma);
      EXPECT_GT((stress - sigma).norm(), 1e-5 * sigma.norm());
    }
    const Mat34 force = nodal_forces(tet, Q, stress);
    EXPECT_LT((elements.force[t] - force).norm(), 1e-12 * force.norm());
  }
  // Squeezed below 6 %, the paper's rule needs QR: such tets are left to the others, and those of the default rule are not.
  const Mat3 squeeze = Vec3(0.05, 1, 1).asDiagonal();
  double energy = 0;
  for (std::size_t i = 0; i < body.state.x.size(); ++i) body.state.x[i] = squeeze * body.mesh.X[i];
  for (int t = 0; t + 4 <= rest.tet_count(); t += 4) {
    bool papers = false;
    for (int k = t; k < t + 4; ++k) papers |= rest.material_of(k).rotation == RotationRule::polar_qr;
    EXPECT_EQ(update_element_quad(rest, body.mesh.tets, t, body.state.x, body.state.plastic_strain, elements, energy), !papers);
  }
}

// A tet's bits are its own, whoever its neighbours in the lanes are.
TEST(ElementQuad, LanesDoNotSeeEachOther) {
  const Shaken body(0.04);
  const RestBody rest = test::rest_body(body.mesh, FemMaterial{}, 1e9);
  const Elements at_zero = by_fours(body, rest, 0), at_two = by_fours(body, rest, 2);
  for (int t = 2; t + 2 < rest.tet_count(); ++t) EXPECT_EQ(at_zero.force[t], at_two.force[t]) << t;
}

}  // namespace
}  // namespace crumple::sim::fem
