#pragma once

#include "server/sim/fem/implicit_euler.h"
#include "server/sim/fracture/fracture_step.h"
#include "tests/support/kuhn_lattice.h"

namespace crumple::sim::fracture {

// A plate of one cell's thickness, cells[0] x cells[1] of edge H, with a closed crack from x = 0 to `crack` at half its
// height. Loaded slowly: always in equilibrium.
struct NotchedPlate {
  static constexpr double H = 0.1, kYoung = 1e7, kToughness = 1e5;

  NotchedPlate(std::array<int, 2> cells, double crack, fem::FractureOrder order, double poisson = 0.3, int threads = 1)
      : mesh(test::kuhn_lattice({cells[0], cells[1], 1}, H)), middle(H * cells[1] / 2), pool(threads) {
    fem::FemMaterial material;
    material.young = kYoung;
    material.poisson = poisson;
    material.breakable = true;
    material.toughness = kToughness;
    material.max_splits_per_step = 10'000;
    material.fracture_order = order;
    rest = *fem::make_rest_body(mesh, material);
    state = {mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), std::vector<Mat3>(mesh.tets.size(), Mat3::Zero())};
    stars = NodeStars(mesh.tets, mesh.node_count());
    std::vector<SplitCandidate> cut;
    for (int n = 0; n < mesh.node_count(); ++n)
      if (std::abs(mesh.X[n].y() - middle) < 1e-9 && mesh.X[n].x() < crack - 1e-9) cut.push_back({n, Vec3::UnitY(), 1});
    follow(split_nodes(mesh.tets, state, stars, cut, {}));
  }

  void follow(const SplitReport& report) {
    extend_by_origin(mesh.X, report.origin);
    fem::follow_topology(rest, mesh.tets, mesh.node_count());
  }

  // Equilibrium with the lower edge held and the upper one moved by d from rest [m].
  void load(const Vec3& d) {
    const double top = 2 * middle, dt = 10;  // [s]: inertia is 1e-6 of stiffness
    for (int k = 0; k < 2; ++k) {
      std::vector<fem::PrescribedNode> held;
      for (int n = 0; n < mesh.node_count(); ++n) {
        state.v[n].setZero();
        const Vec3& X = mesh.X[n];
        if (X.y() < 1e-9) held.push_back({n, (X - state.x[n]) / dt});
        if (X.y() > top - 1e-9) held.push_back({n, (X + d - state.x[n]) / dt});
      }
      fem::StepOptions options;
      options.dt = dt;
      options.solve = {1e-8, 20'000};
      fem::implicit_euler_step(rest, mesh.tets, state, Eigen::VectorXd::Zero(3 * mesh.node_count()), held, options,
                               pool, solver);
    }
    fem::update_elements(rest, mesh.tets, state.x, state.plastic_strain, pool, elements);
  }

  void place(const std::vector<Vec3>& x) {
    state.x = x;
    fem::update_elements(rest, mesh.tets, state.x, state.plastic_strain, pool, elements);
  }

  SplitReport tear(std::uint64_t seed = 1, std::uint64_t step = 0) {
    const SplitReport report = fracture_step(rest, elements, seed, step, pool, mesh.tets, state, stars, scratch);
    follow(report);
    return report;
  }

  TetMesh mesh;
  double middle;  // y of the crack [m]
  ThreadPool pool;
  fem::RestBody rest;
  fem::FemState state;
  fem::Elements elements;
  fem::StepScratch solver;
  NodeStars stars;
  FractureScratch scratch;
};

}  // namespace crumple::sim::fracture
