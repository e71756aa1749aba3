#include "server/sim/linear_solver/multigrid_hierarchy.h"

#include "server/sim/mesh/node_stars.h"
#include "tests/support/kuhn_lattice.h"
#include "tests/sim/linear_solver/tet_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace crumple::sim::linear_solver {
namespace {

const ThreadPool kOne(1);
constexpr double kTetVolume = 1e-3 / 6;

// A matrix on the mesh whose blocks are functions of where their nodes are.
BlockSparseMatrix<double> matrix_of(const TetMesh& mesh) {
  auto A = BlockSparseMatrix<double>::from_edges(mesh.node_count(), edges_of(mesh.tets));
  for (int i = 0; i < A.rows(); ++i) {
    A.diagonal()[i] = (1 + mesh.X[i].squaredNorm()) * Mat3::Identity();
    for (int k = A.row_start()[i]; k < A.row_start()[i + 1]; ++k) A.set_block(k, Mat3(mesh.X[i] * mesh.X[A.columns()[k]].transpose()));
  }
  return A;
}

struct Breaking {
  TetMesh mesh;
  std::vector<char> held;
  std::mt19937 random{17};

  Breaking(std::array<int, 3> cells, bool shaken) : mesh(test::kuhn_lattice(cells, 0.1)) {
    std::uniform_real_distribution<double> shake(-0.02, 0.02);
    for (Vec3& X : mesh.X) {
      if (shaken) X += Vec3(shake(random), shake(random), shake(random));
      held.push_back(X.x() < 0.05);
    }
  }

  // As fracture does: the tets of a node on one side of a plane through it get a node of their own.
  void split() {
    const NodeStars stars(mesh.tets, mesh.node_count());
    std::normal_distribution<double> normal;
    while (true) {
      const int node = static_cast<int>(random() % mesh.X.size());
      const Vec3 n(normal(random), normal(random), normal(random));
      std::vector<int> moved;
      for (const int t : stars[node]) {
        Vec3 centre = Vec3::Zero();
        for (const int i : mesh.tets[t]) centre += 0.25 * mesh.X[i];
        if (n.dot(centre - mesh.X[node]) > 0) moved.push_back(t);
      }
      if (moved.empty() || moved.size() == stars[node].size()) continue;
      for (const int t : moved) std::ranges::replace(mesh.tets[t], node, mesh.node_count());
      mesh.X.push_back(mesh.X[node]);
      held.push_back(held[node]);
      return;
    }
  }

  // As pieces that leave do: some tets go, and nodes without a tet; the others close ranks.
  void lose(int tets) {
    const int first = static_cast<int>(random() % (mesh.tets.size() - tets));
    mesh.tets.erase(mesh.tets.begin() + first, mesh.tets.begin() + first + tets);
    std::vector<int> id(mesh.X.size(), -1);
    for (const Tet& tet : mesh.tets)
      for (const int i : tet) id[i] = 0;
    int count = 0;
    for (std::size_t i = 0; i < id.size(); ++i) {
      if (id[i] < 0) continue;
      id[i] = count;
      mesh.X[count] = mesh.X[i];
      held[count++] = held[i];
    }
    mesh.X.resize(count);
    held.resize(count);
    for (Tet& tet : mesh.tets)
      for (int& i : tet) i = id[i];
  }
};

void expect_same(const MultigridHierarchy& a, const MultigridHierarchy& b, int round) {
  ASSERT_EQ(a.levels().size(), b.levels().size()) << round;
  for (std::size_t l = 0; l < a.levels().size(); ++l) {
    const auto &p = a.levels()[l], &q = b.levels()[l];
    ASSERT_EQ(p.transfer, q.transfer) << round << " level " << l;
    ASSERT_EQ(p.product, q.product) << round << " level " << l;
    ASSERT_TRUE(std::ranges::equal(p.A.columns(), q.A.columns())) << round;
    ASSERT_EQ(p.A.diagonal(), q.A.diagonal()) << round;
    ASSERT_TRUE(std::equal(p.A.values(), p.A.values() + 9 * p.A.block_count(), q.A.values())) << round;
  }
}

class Splits : public testing::TestWithParam<bool> {};

TEST_P(Splits, LeaveTheLevelsThatMakingThemAnewWouldGiveBitForBit) {
  Breaking body({14, 6, 6}, GetParam());
  MultigridHierarchy followed;
  followed.update(matrix_of(body.mesh), body.mesh.X, body.held, kTetVolume, kOne);
  ASSERT_GE(followed.levels().size(), 2u);
  for (int round = 0; round < 40; ++round) {
    for (int k = 0; k < 1 + round % 7; ++k) body.split();
    if (round % 5 == 4) body.lose(1 + round);
    if (round == 30) std::ranges::fill(body.held, char{0});
    const auto A = matrix_of(body.mesh);
    followed.update(A, body.mesh.X, body.held, kTetVolume, kOne);
    MultigridHierarchy anew;
    anew.update(A, body.mesh.X, body.held, kTetVolume, kOne);
    expect_same(followed, anew, round);
    if (HasFatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(MultigridHierarchy, Splits, testing::Bool());

// What is far from a split is taken over, not found again: else following would cost what making anew does.
TEST(LevelChange, OfOneSplitIsNearIt) {
  Breaking body({20, 8, 8}, false);
  const auto before = matrix_of(body.mesh);
  const CoarseLattice lattice = coarse_lattice(body.mesh.X, kTetVolume);
  std::vector<Vec3> coarse_X;
  const auto transfer = [&](const BlockSparseMatrix<double>& A) {
    return make_transfer(body.mesh.X, {A.row_start(), A.columns()}, body.held, lattice, true, coarse_X);
  };
  const LevelTransfer old = transfer(before);
  const std::vector<Vec3> old_X = body.mesh.X;
  body.split();
  const auto now = matrix_of(body.mesh);
  const LevelTransfer made = transfer(now);
  const LevelChange change = level_change({{before.row_start(), before.columns()}, old}, {{now.row_start(), now.columns()}, made},
                                          match_points(old_X, body.mesh.X));
  EXPECT_EQ(change.fine_before.back(), -1);
  const auto changed = std::ranges::count(change.same, 0);
  EXPECT_GT(changed, 0);
  EXPECT_LT(changed, 40);  // of 275: those within two lattice cells
  const Vec3 at = body.mesh.X.back();
  for (int J = 0; J < made.coarse_count(); ++J)
    if (!change.same[J]) EXPECT_LT((coarse_X[J] - at).cwiseAbs().maxCoeff(), 0.61) << J;
}

}  // namespace
}  // namespace crumple::sim::linear_solver
