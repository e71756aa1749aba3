#include "server/sim/islands/rigid_modes.h"

#include <gtest/gtest.h>

#include "server/sim/islands/island_system.h"
#include "tests/sim/islands/soft_scene.h"

namespace crumple::sim::islands {
namespace {

using Eigen::VectorXd;
using linear_solver::SolverKind;

// A tower of stiff blocks on a held one, a rigid box on top: as many pieces in contact as asked for, and two more.
SoftScene tower(int free_blocks) {
  SoftScene scene;
  scene.passes = 1;
  for (int k = 0; k <= free_blocks; ++k)
    scene.add_soft({1, 1, 2}, Vec3(0.1, 0.1, 0.2), Vec3(0.001 * k, 0.0999 * k, 0), Vec3(0, -0.02 * k, 0), 1e9);
  for (int n = 0; n < scene.soft[0].mesh.node_count(); n += 2) scene.soft[0].prescribed.push_back({n, Vec3::Zero()});
  scene.add_rigid(Vec3(0.1, 0.1, 0.1), Vec3(0.05, 0.0999 * (free_blocks + 1) + 0.0499, 0.1), 3, true).v = Vec3(0, -0.02 * (free_blocks + 1), 0.5);
  return scene;
}

// An island of a tower, its rows at work.
struct Assembled {
  explicit Assembled(int free_blocks) : scene(tower(free_blocks)), bodies(scene.assemble()) {
    scene.detect();
    island = composite_islands(bodies, scene.rows).at(0);
    for (contact::ContactRow& row : island.rows) row.c_t = 0.3 * row.c_n;
    system.emplace(island, bodies);
    rows = contact::ContactRows(island.rows, system->first_block(), system->blocks());
    const auto multiply = [&](const VectorXd& x, VectorXd& y) { system->multiply(x, y, *scene.pool); };
    std::vector<ModesPart> parts;
    std::vector<Mat3> rigid;
    system->modes_parts(parts);
    system->rigid_diagonal(rigid);
    modes.emplace(parts, rigid, multiply);
    rows.refresh(ThreadPool(1));
    modes->factor(rows);
  }

  VectorXd apply(const VectorXd& x) const {
    VectorXd y(x.size());
    system->multiply(x, y, *scene.pool);
    rows.apply_add(x, y, *scene.pool);
    return y;
  }
  VectorXd correction(const VectorXd& r) {
    VectorXd z = VectorXd::Zero(r.size());
    modes->add_to(r, z);
    return z;
  }
  VectorXd any(unsigned seed) const {
    std::srand(seed);
    return VectorXd::Random(3 * system->blocks());
  }

  SoftScene scene;
  std::vector<IslandBody> bodies;
  CompositeIsland island;
  std::optional<IslandSystem> system;
  contact::ContactRows rows;
  std::optional<RigidModes> modes;
};

class Towers : public testing::TestWithParam<int> {};  // few bodies are coupled, many are not
class CoupledTowers : public Towers {};

TEST_P(CoupledTowers, LeaveNoForceAndNoMomentOnAnyPiece) {
  Assembled a(GetParam());
  ASSERT_LE(a.modes->count(), RigidModes::kMostCoupled);
  ASSERT_EQ(a.modes->count(), GetParam() + 1);
  const VectorXd r = a.any(3);
  const VectorXd left = r - a.apply(a.correction(r));
  const double size = r.norm();
  for (int b = 1; b <= GetParam(); ++b) {
    const SoftBody& body = a.scene.soft[b];
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (int i = 0; i < body.mesh.node_count(); ++i) {
      const Vec3 f = left.segment<3>(3 * (a.system->first_block()[b] + i));
      force += f;
      moment += (body.state.x[i] - body.centre()).cross(f);
    }
    EXPECT_LT(force.norm(), 1e-6 * size) << b;  // kLeastInertia is all that is not exact
    EXPECT_LT(moment.norm(), 1e-6 * size) << b;
  }
  EXPECT_LT(left.tail(6).norm(), 1e-6 * size);
}

TEST_P(Towers, MovePiecesRigidlyAndWhatIsHeldNotAtAll) {
  Assembled a(GetParam());
  const VectorXd z = a.correction(a.any(4));
  const int held = 3 * a.scene.soft[0].mesh.node_count();
  EXPECT_EQ(z.head(held).norm(), 0);
  for (int b = 1; b <= GetParam(); ++b) {
    const std::vector<Vec3>& x = a.scene.soft[b].state.x;
    const auto v = [&](int i) { return Vec3(z.segment<3>(3 * (a.system->first_block()[b] + i))); };
    for (int i = 1; i < static_cast<int>(x.size()); ++i)
      EXPECT_NEAR((v(i) - v(0)).dot(x[i] - x[0]), 0, 1e-12 * (1 + z.norm())) << b;  // no edge is stretched
  }
}

TEST_P(Towers, AreSymmetricAndNotNegative) {
  Assembled a(GetParam());
  const VectorXd r = a.any(5), s = a.any(6);
  const double rs = r.dot(a.correction(s)), sr = s.dot(a.correction(r));
  EXPECT_NEAR(rs, sr, 1e-10 * std::sqrt(r.dot(a.correction(r)) * s.dot(a.correction(s))));
  EXPECT_GT(r.dot(a.correction(r)), 0);
}

INSTANTIATE_TEST_SUITE_P(RigidModes, CoupledTowers, testing::Values(2, 20));
INSTANTIATE_TEST_SUITE_P(RigidModes, Towers, testing::Values(2, 20, 40));

class Iterations : public testing::TestWithParam<int> {};

TEST_P(Iterations, AreFarFewerOfStiffPiecesInContact) {
  // The same motion as by a Cholesky factor of the whole system, which is not ours.
  SoftScene direct = tower(GetParam());
  direct.solver = SolverKind::direct;
  direct.step();
  int iterations[2];
  for (int k = 0; k < 2; ++k) {
    SoftScene scene = tower(GetParam());
    scene.solver = k == 0 ? SolverKind::jacobi : SolverKind::rigid_modes;
    scene.solve = {1e-10, 20000};
    scene.step();
    iterations[k] = scene.solutions[0].report.iterations;
    for (std::size_t b = 0; b < scene.soft.size(); ++b)
      EXPECT_LT((scene.soft[b].velocity() - direct.soft[b].velocity()).norm(), 1e-6) << b;
  }
  EXPECT_LT(2 * iterations[1], iterations[0]) << iterations[1] << " of " << iterations[0];
}

INSTANTIATE_TEST_SUITE_P(RigidModes, Iterations, testing::Values(20, 40));

TEST(RigidModes, AreTakenForSmallStiffPiecesAndNotForSoftOnes) {
  const auto chosen = [](double young) {
    SoftScene scene;
    scene.add_soft({1, 1, 1}, Vec3(0.1, 0.1, 0.1), Vec3::Zero(), Vec3::Zero(), young);
    std::vector<IslandBody> bodies = scene.assemble();
    bodies[0].factor = nullptr;  // as of what has broken
    scene.detect();
    const CompositeIsland island = composite_islands(bodies, scene.rows).at(0);
    return IslandSystem(island, bodies).choose(SolverKind::automatic);
  };
  EXPECT_EQ(chosen(1e9), SolverKind::rigid_modes);
  EXPECT_EQ(chosen(1e3), SolverKind::jacobi);
}

}  // namespace
}  // namespace crumple::sim::islands
