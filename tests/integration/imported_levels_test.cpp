// Multigrid on tet meshes of others, which stand on no lattice: one is laid over them.
#include "server/io/tet_import.h"
#include "server/sim/islands/composite_island.h"
#include "tests/support/shared_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace crumple::sim {
namespace {

using linear_solver::SolverKind;

// A body that hangs by its tenth with the lowest x, shaken, scaled to a length of 2 m.
struct Hung {
  TetMesh mesh;
  fem::RestBody rest;
  fem::FemState state;
  fem::StepSystem system;
  linear_solver::MultigridHierarchy hierarchy;
  ThreadPool pool{1};

  explicit Hung(const std::string& file) {
    mesh = io::import_tets(test::shared_data("meshes/" + file)).value().mesh;
    const auto [low, high] = std::ranges::minmax(mesh.X, {}, [](const Vec3& X) { return X.x(); });
    for (Vec3& X : mesh.X) X *= 2 / (high.x() - low.x());
    fem::FemMaterial material;
    material.young = 1e8;
    rest = fem::make_rest_body(mesh, material).value();
    std::vector<double> along;
    for (const Vec3& X : mesh.X) along.push_back(X.x());
    std::ranges::nth_element(along, along.begin() + static_cast<std::ptrdiff_t>(along.size() / 10));
    std::vector<fem::PrescribedNode> held;
    Eigen::VectorXd f(3 * mesh.node_count());
    for (int n = 0; n < mesh.node_count(); ++n) {
      f.segment<3>(3 * n) = rest.node_mass[n] * Vec3(0, -9.81, 3 * mesh.X[n].x());
      if (mesh.X[n].x() < along[along.size() / 10]) held.push_back({n, Vec3::Zero()});
    }
    state = {mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), std::vector<Mat3>(mesh.tets.size(), Mat3::Zero())};
    fem::assemble(rest, mesh.tets, state, f, 1.0 / 60, held, pool, system);
  }

  islands::IslandSolution solve(SolverKind solver) {
    const double volume = std::accumulate(rest.volume.begin(), rest.volume.end(), 0.0);
    const std::vector<islands::IslandBody> bodies{
        {.system = &system, .hierarchy = &hierarchy, .x = &state.x, .X = &mesh.X, .mean_tet_volume = volume / mesh.tet_count()}};
    islands::CompositeIsland island{.soft = {0}};
    return islands::solve(island, bodies, {.solve = {1e-6, 5000}, .solver = solver}, {}, pool);
  }
};

class ImportedTets : public testing::TestWithParam<const char*> {};

TEST_P(ImportedTets, HaveCoarseLevelsAndNeedFewIterations) {
  CRUMPLE_NEED_SHARED("meshes");
  Hung body(GetParam());
  const auto paper = body.solve(SolverKind::jacobi), multigrid = body.solve(SolverKind::multigrid);
  ASSERT_GE(body.hierarchy.levels().size(), 1u);
  const int nodes = body.mesh.node_count(), coarse = body.hierarchy.levels().front().A.rows();
  EXPECT_LT(coarse, 0.6 * nodes);
  EXPECT_GT(coarse, 0.02 * nodes);
  EXPECT_TRUE(multigrid.report.converged && paper.report.converged);
  EXPECT_LT(2 * multigrid.report.iterations, paper.report.iterations);
  EXPECT_LT((multigrid.velocity - paper.velocity).norm(), 1e-3 * paper.velocity.norm());
  RecordProperty("coarse", coarse);
  RecordProperty("iterations", multigrid.report.iterations);
  RecordProperty("iterations_of_block_jacobi", paper.report.iterations);
}

INSTANTIATE_TEST_SUITE_P(MultigridOf, ImportedTets, testing::Values("vega_beam3_tet.veg", "femfx_car-body-tets.node"));

}  // namespace
}  // namespace crumple::sim
