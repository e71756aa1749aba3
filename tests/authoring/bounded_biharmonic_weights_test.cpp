#include "server/authoring/bounded_biharmonic_weights.h"

#include "server/authoring/boundary_fit.h"
#include "server/authoring/enclosing_mesh.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/shapes/barrel.h"
#include "server/authoring/shapes/surfaces.h"
#include "server/authoring/tet_laplacian.h"
#include "tests/authoring/handles_for_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <chrono>
#include <ctime>
#include <queue>

namespace crumple::authoring {
namespace {

using sim::TetMesh;
using ::testing::HasSubstr;

TetMesh ball(double cell_size) {
  const sim::SurfaceMesh sphere = icosphere(1, 4);
  return fitted_to_surface(*enclosing_mesh(sphere, {.cell_size = cell_size}), sphere);
}

int nearest(const TetMesh& mesh, const Vec3& p) {
  return static_cast<int>(std::ranges::min_element(mesh.X, {}, [&](const Vec3& X) { return (X - p).squaredNorm(); }) -
                          mesh.X.begin());
}

std::vector<std::vector<int>> vertex_neighbours(const TetMesh& mesh) {
  std::vector<std::vector<int>> out(mesh.node_count());
  for (const Tet& tet : mesh.tets)
    for (const int a : tet)
      for (const int b : tet)
        if (a != b) out[a].push_back(b);
  return out;
}

// How high a weight stands at its most above the pass on the way to its handle, over all columns: 0 where every set
// {w >= level} hangs together around the handle, that is, where no weight has a maximum elsewhere.
double highest_stray_maximum(const TetMesh& mesh, const Eigen::MatrixXd& W, const std::vector<int>& handle_vertices) {
  const auto neighbours = vertex_neighbours(mesh);
  double highest = 0;
  for (int b = 0; b < W.cols(); ++b) {
    std::vector<double> pass(mesh.X.size(), -1);  // the lowest point of the highest way from the handle
    std::priority_queue<std::pair<double, int>> next;
    next.emplace(W(handle_vertices[b], b), handle_vertices[b]);
    while (!next.empty()) {
      const auto [level, i] = next.top();
      next.pop();
      if (pass[i] >= level) continue;
      pass[i] = level;
      highest = std::max(highest, W(i, b) - level);
      for (const int j : neighbours[i])
        if (const double there = std::min(level, W(j, b)); there > pass[j]) next.emplace(there, j);
    }
  }
  return highest;
}

// ---- against other answers
// Along a thin bar the problem is min int w''^2 with w' = 0 at the ends (the boundary condition of L M^-1 L): between
// two handles at the ends a cubic, 3 s^2 - 2 s^3. With a third in the middle the bounds act: each half is such a cubic,
// where the unbounded spline of an end handle would swing below zero in the far half.
TEST(BoundedBiharmonicWeights, OfAThinBarAreTheCubicsOfAClampedBeam) {
  const auto cubic = [](double s) { return 3 * s * s - 2 * s * s * s; };
  const auto at = [](double x) { return Vec3(x, 0, 0); };
  const BiharmonicOptions exact{.tolerance = 1e-7, .max_iterations = 20000};
  std::vector<double> worst_two, worst_three;
  for (const int cells : {20, 40, 80}) {
    const TetMesh mesh = bar(cells, 0.8 / cells);
    const auto two = solve(mesh, points({at(0), at(1)}), exact);
    const auto three = solve(mesh, points({at(0), at(0.5), at(1)}), exact);
    EXPECT_TRUE(two.report.converged && three.report.converged);
    worst_two.push_back(0);
    worst_three.push_back(0);
    for (int i = 0; i < mesh.node_count(); ++i) {
      const double x = mesh.X[i].x();
      worst_two.back() = std::max(worst_two.back(), std::abs(two.W(i, 1) - cubic(x)));
      const double last = x > 0.5 ? cubic(2 * x - 1) : 0, middle = x > 0.5 ? 1 - last : cubic(2 * x);
      worst_three.back() =
          std::max({worst_three.back(), std::abs(three.W(i, 2) - last), std::abs(three.W(i, 1) - middle)});
    }
  }
  EXPECT_LT(worst_two[2], 3e-4);
  EXPECT_LT(worst_three[2], 6e-3);
  EXPECT_LT(worst_three[1], 0.7 * worst_three[0]);  // first order in the cell at the kink of the bounds
  EXPECT_LT(worst_three[2], 0.7 * worst_three[1]);
}

// The same optimum by another method: a dense primal-dual active set. Unknowns w_ib; each row sums to 1 by a
// multiplier, entries in the active set are 0; those whose multiplier is negative leave it, negative ones enter.
Eigen::MatrixXd active_set_answer(const TetMesh& mesh, const PrescribedWeights& prescribed) {
  const auto [L, M] = tet_laplacian(mesh);
  const Eigen::MatrixXd D = Eigen::MatrixXd(L), Q = D * M.cwiseInverse().asDiagonal() * D;
  const int n = mesh.node_count(), B = static_cast<int>(prescribed.weights.cols());
  std::vector<int> free;
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(n, B);
  for (int i = 0; i < n; ++i)
    if (std::ranges::count(prescribed.vertices, i) == 0) free.push_back(i);
  W(prescribed.vertices, Eigen::all) = prescribed.weights;
  const Eigen::MatrixXd G = Q * W;
  const int f = static_cast<int>(free.size()), unknowns = f * B;
  std::vector<char> active(unknowns, false);
  for (int round = 0; round < 60; ++round) {
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(unknowns + f, unknowns + f);
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns + f);
    for (int b = 0; b < B; ++b)
      for (int i = 0; i < f; ++i) {
        const int row = b * f + i;
        if (active[row]) {
          K(row, row) = 1;
          continue;
        }
        for (int j = 0; j < f; ++j)
          if (!active[b * f + j]) K(row, b * f + j) = Q(free[i], free[j]);
        K(row, unknowns + i) = K(unknowns + i, row) = 1;
        rhs[row] = -G(free[i], b);
      }
    rhs.tail(f).setOnes();
    const Eigen::VectorXd x = K.partialPivLu().solve(rhs);
    bool changed = false;
    for (int b = 0; b < B; ++b)
      for (int i = 0; i < f; ++i) {
        const int row = b * f + i;
        double multiplier = G(free[i], b) + x[unknowns + i];
        for (int j = 0; j < f; ++j) multiplier += Q(free[i], free[j]) * x[b * f + j];
        const char next = active[row] ? multiplier > 0 : x[row] < 0;
        changed = changed || next != active[row];
        active[row] = next;
      }
    for (int b = 0; b < B; ++b)
      for (int i = 0; i < f; ++i) W(free[i], b) = x[b * f + i];
    if (!changed) return W;
  }
  ADD_FAILURE() << "the active set does not settle";
  return W;
}

TEST(BoundedBiharmonicWeights, AreThoseOfADenseActiveSet) {
  const TetMesh mesh = *centred_box_mesh({2, 1, 0.6}, {4, 2, 2}, Lattice::bcc);
  const Handles handles = points({{-1, -0.5, 0}, {1, 0.5, 0.3}, {1, -0.5, -0.3}, {0, 0, 0.3}});
  const auto prescribed = prescribed_weights(mesh, handles);
  ASSERT_TRUE(prescribed);
  const Eigen::MatrixXd expected = active_set_answer(mesh, *prescribed);
  EXPECT_LT(outside_simplex(expected), 1e-9);
  EXPECT_GT((expected.array() == 0).count(), 20);  // the bounds act

  const auto ours = solve(mesh, handles, {.tolerance = 1e-11, .max_iterations = 100000});
  EXPECT_TRUE(ours.report.converged);
  EXPECT_LT((ours.W - expected).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(ours.report.energy, ours.report.relaxed_energy, 1e-6 * ours.report.energy);

  // As a user would ask for it.
  EXPECT_LT((solve(mesh, handles).W - expected).cwiseAbs().maxCoeff(), 5e-3);
}

// ---- what is promised of any
TEST(BoundedBiharmonicWeights, AreBoundedSumToOneAndPeakAtTheirHandles) {
  const sim::SurfaceMesh barrel = barrel_surface();
  const TetMesh barrel_mesh = fitted_to_surface(*enclosing_mesh(barrel, {.cell_size = 0.1}), barrel);
  for (const TetMesh& mesh : {ball(0.25), barrel_mesh}) {
    const auto ids = place_handles(mesh, surface_nodes(mesh.tets), 12);
    const auto out = solve(mesh, points(points_of(mesh, ids)));
    EXPECT_TRUE(out.report.converged);
    EXPECT_LT(outside_simplex(out.W), 1e-9);
    for (size_t b = 0; b < ids.size(); ++b) EXPECT_EQ(out.W(ids[b], static_cast<int>(b)), 1);
    EXPECT_LT(highest_stray_maximum(mesh, out.W, ids), 0.05);  // the optimum's own, at corners
    EXPECT_GT(out.report.energy, out.report.relaxed_energy * 0.99);
    EXPECT_LT(out.report.energy, out.report.relaxed_energy * 1.01);
  }
}

// Points, a bone and a cage at once. Smooth: what a weight changes along an edge falls as edges get shorter, where a
// jump would not.
TEST(BoundedBiharmonicWeights, OfPointsBonesAndCagesAreBoundedAndSmooth) {
  Handles handles = points({{0, 0, 1}, {0.7, 0, 0.7}, {0.7, 0.7, 0}, {-0.7, 0, -0.7}});
  handles.handles.push_back({{-0.5, -0.6, -0.2}, {0.3, -0.6, -0.2}});
  handles.handles.push_back({{-0.4, 0.6, -0.3}, {-0.4, 0.6, 0.3}});
  handles.cage_faces = {{0, 1, 2}};
  handles.cage_edges = {{0, 3}};
  std::vector<double> steepest;
  for (const double cell : {0.36, 0.18}) {
    const TetMesh mesh = ball(cell);
    const auto out = solve(mesh, handles);
    EXPECT_TRUE(out.report.converged);
    EXPECT_LT(outside_simplex(out.W), 1e-9);
    EXPECT_GT(out.W.colwise().maxCoeff().minCoeff(), 0.99);  // every handle holds something as its own
    steepest.push_back(0);
    for (const Tet& tet : mesh.tets)
      for (const int a : tet)
        for (const int b : tet)
          steepest.back() = std::max(steepest.back(), (out.W.row(a) - out.W.row(b)).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(steepest[1], 0.75 * steepest[0]) << steepest[0];
}

TEST(BoundedBiharmonicWeights, DoNotLeakAcrossAGap) {
  // A U: two arms of 1 x 0.25 beside each other, 0.25 apart, joined at x = 0. Straight across it is 0.5, around 2.25.
  TetMesh mesh = *box_mesh({.size = {1, 0.75, 0.25}, .cells = {8, 6, 2}, .minimum = Vec3::Zero()});
  std::erase_if(mesh.tets, [&](const Tet& tet) {
    Vec3 centre = Vec3::Zero();
    for (const int i : tet) centre += mesh.X[i] / 4;
    return centre.x() > 0.25 && centre.y() > 0.25 && centre.y() < 0.5;
  });
  const auto out = solve(mesh, points({{1, 0.125, 0.125}, {1, 0.625, 0.125}, {0, 0.375, 0.125}}));
  for (int i = 0; i < mesh.node_count(); ++i)
    if (mesh.X[i].x() > 0.6 && mesh.X[i].y() > 0.45) {
      EXPECT_LT(out.W(i, 0), 1e-3);
    }
}

TEST(BoundedBiharmonicWeights, MirrorsWithItsHandles) {
  const TetMesh mesh = *centred_box_mesh({2, 1, 1}, {8, 4, 4}, Lattice::kuhn);  // X -> -X takes it onto itself
  const auto out = solve(mesh, points({{-1, 0, 0}, {1, 0, 0}}), {.tolerance = 1e-8, .max_iterations = 5000});
  EXPECT_NEAR(out.W(nearest(mesh, Vec3::Zero()), 0), 0.5, 1e-6);
  for (int i = 0; i < mesh.node_count(); ++i)
    EXPECT_NEAR(out.W(i, 0), out.W(nearest(mesh, -mesh.X[i]), 1), 1e-6) << mesh.X[i].transpose();
}

TEST(BoundedBiharmonicWeights, DoNotDependOnOrderScalePlaceOrThreads) {
  const TetMesh mesh = ball(0.35);
  std::vector<Vec3> at = points_of(mesh, place_handles(mesh, surface_nodes(mesh.tets), 9));
  const Eigen::MatrixXd W = solve(mesh, points(at)).W;

  std::vector<Vec3> reversed(at.rbegin(), at.rend());
  EXPECT_LT((solve(mesh, points(reversed)).W.rowwise().reverse() - W).cwiseAbs().maxCoeff(), 1e-10);

  const Mat3 R = Eigen::AngleAxisd(1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  TetMesh moved = mesh;
  for (Vec3& X : moved.X) X = 1000 * R * X + Vec3(5, 6, 7);
  for (Vec3& p : at) p = 1000 * R * p + Vec3(5, 6, 7);
  EXPECT_LT((solve(moved, points(at)).W - W).cwiseAbs().maxCoeff(), 1e-7);

  const sim::ThreadPool two(2);
  EXPECT_EQ(solve(moved, points(at)).W, solve(moved, points(at), {.pool = &two}).W);
}

TEST(BoundedBiharmonicWeights, StartIsTheSameByWoodburyAndByTheWholeFactor) {
  // Handles on an eighth of the vertices and more take the whole factor. One column more, of a vertex on its own, must
  // not change what the others do far from it; here: constants are reproduced by both.
  const TetMesh mesh = *centred_box_mesh({1, 1, 1}, {4, 4, 4}, Lattice::kuhn);
  std::vector<int> few, many;
  for (int i = 0; i < mesh.node_count(); i += 20) few.push_back(i);
  for (int i = 0; i < mesh.node_count(); i += 4) many.push_back(i);
  for (const auto& ids : {few, many}) {
    const auto prescribed = prescribed_weights(mesh, points(points_of(mesh, ids)));
    ASSERT_TRUE(prescribed);
    const auto ours = solve(mesh, points(points_of(mesh, ids)), {.tolerance = 1e-8, .max_iterations = 20000});
    EXPECT_TRUE(ours.report.converged);
    // Optimal: moving any row towards any corner of the simplex does not lower the energy.
    const auto [L, M] = tet_laplacian(mesh);
    const Eigen::MatrixXd gradient = L * M.cwiseInverse().asDiagonal() * (L * ours.W);
    const double scale = (L * M.cwiseInverse().asDiagonal() * L).eval().diagonal().maxCoeff();
    for (int i = 0; i < mesh.node_count(); ++i) {
      if (std::ranges::count(ids, i) > 0) continue;
      for (int b = 0; b < ours.W.cols(); ++b) {
        const double slope = gradient(i, b) - gradient.row(i).dot(ours.W.row(i));
        EXPECT_GT(slope, -1e-5 * scale);
      }
    }
  }
}

TEST(BoundedBiharmonicWeights, SliversDoNotSpoilThem) {
  TetMesh mesh = *centred_box_mesh({2, 1, 1}, {6, 3, 3}, Lattice::bcc);
  const Handles handles = points({{-1, 0, 0}, {1, 0, 0}, {0, 0.5, 0}});
  const Eigen::MatrixXd W = solve(mesh, handles).W;
  // Two needles of 1e-9 of a cell, hung onto a face of a boundary tet.
  const auto face = sim::surface_faces(mesh.tets).front();
  const Vec3 a = mesh.X[face.nodes[0]], b = mesh.X[face.nodes[1]], c = mesh.X[face.nodes[2]];
  mesh.X.push_back((a + b + c) / 3 + 1e-9 * (b - a).cross(c - a).normalized());
  mesh.tets.push_back({face.nodes[0], face.nodes[1], face.nodes[2], mesh.node_count() - 1});
  ASSERT_TRUE(sim::validate(mesh, "mesh"));
  const auto out = solve(mesh, handles);
  EXPECT_LT(outside_simplex(out.W), 1e-9);
  EXPECT_LT((out.W.topRows(W.rows()) - W).cwiseAbs().maxCoeff(), 0.02);
}

// ---- parts, and what is no input
TEST(BoundedBiharmonicWeights, APartWithoutAHandleMovesAsOneWithWhatIsNearest) {
  TetMesh mesh = bar(8, 0.1);
  const int first = mesh.node_count();
  const TetMesh other = *box_mesh({.size = {0.3, 0.1, 0.1}, .cells = {3, 1, 1}, .minimum = Vec3(1.05, 0, 0)});
  for (const Vec3& X : other.X) mesh.X.push_back(X);
  for (const Tet& tet : other.tets)
    mesh.tets.push_back({tet[0] + first, tet[1] + first, tet[2] + first, tet[3] + first});
  mesh.X.push_back({0.001, 0, 0});  // of no tet
  const auto out = solve(mesh, points({{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}}));
  EXPECT_EQ(out.report.components, 2);
  EXPECT_EQ(out.report.components_without_handle, 1);
  EXPECT_LT(outside_simplex(out.W), 1e-9);
  for (int i = first; i + 1 < mesh.node_count(); ++i) EXPECT_EQ(out.W.row(i), out.W.row(first));
  EXPECT_GT(out.W(first, 2), 0.9);
  EXPECT_EQ(out.W(mesh.node_count() - 1, 0), 1);
}

TEST(BoundedBiharmonicWeights, PartsWithHandlesOfTheirOwnDoNotSeeEachOther) {
  TetMesh mesh = bar(8, 0.1);
  const Eigen::MatrixXd alone = solve(mesh, points({{0, 0, 0}, {1, 0, 0}})).W;
  const int first = mesh.node_count();
  for (int i = 0; i < first; ++i) mesh.X.push_back(mesh.X[i] + Vec3(0, 0.11, 0));  // a hundredth away
  for (int t = 0, count = mesh.tet_count(); t < count; ++t) {
    Tet tet = mesh.tets[t];
    for (int& i : tet) i += first;
    mesh.tets.push_back(tet);
  }
  const auto out = solve(mesh, points({{0, 0, 0}, {1, 0, 0}, {0, 0.21, 0}, {1, 0.21, 0}}));
  EXPECT_EQ(out.report.components, 2);
  EXPECT_EQ(out.report.components_without_handle, 0);
  EXPECT_LT(outside_simplex(out.W), 1e-9);
  EXPECT_LT((out.W.topLeftCorner(first, 2) - alone).cwiseAbs().maxCoeff(), 2e-3);      // the tolerance is of a mean
  EXPECT_LT((out.W.bottomRightCorner(first, 2) - alone).cwiseAbs().maxCoeff(), 2e-2);  // other corners hold it
  EXPECT_LT(out.W.topRightCorner(first, 2).maxCoeff(), 2e-3);
  EXPECT_LT(out.W.bottomLeftCorner(first, 2).maxCoeff(), 2e-3);
}

TEST(BoundedBiharmonicWeights, BadInputIsAnError) {
  const TetMesh mesh = bar(4, 0.25);
  const auto text = [](const auto& r) { return r ? std::string("no error") : r.error().text(); };
  const auto of = [&](const Handles& h) { return text(bounded_biharmonic_weights(mesh, h)); };
  EXPECT_THAT(of({}), HasSubstr("handles holds 0 handles"));
  EXPECT_THAT(of(points({{0, 0, 0}, {3, 0, 0}})), HasSubstr("handles[1] is 2 m outside the mesh"));
  EXPECT_THAT(of(points({{0, std::nan(""), 0}})), HasSubstr("handles[0] is not finite"));
  EXPECT_THAT(of({.handles = {Handle::point({0, 0, 0}), {{0.3, 0, 0}, {0.6, 0, 0}}}, .cage_edges = {{0, 1}}}),
              HasSubstr("cage_edges[0] names handle 1, which is a bone"));
  EXPECT_THAT(of({.handles = {Handle::point({0, 0, 0})}, .cage_edges = {{0, 7}}}), HasSubstr("names handle 7"));
  EXPECT_THAT(of({{Handle::point({0, 0, 0}), Handle{{0, 0, 0}, {0.01, 0, 0}}}}), HasSubstr("no vertex of its own"));
  TetMesh flipped = mesh;
  std::swap(flipped.tets[3][0], flipped.tets[3][1]);
  EXPECT_THAT(text(bounded_biharmonic_weights(flipped, points({{0, 0, 0}}))), HasSubstr("mesh.tets[3] has volume -"));
  EXPECT_THAT(text(bounded_biharmonic_weights(mesh, points({{0, 0, 0}}), {.tolerance = 0})),
              HasSubstr("tolerance is 0"));
}

TEST(BoundedBiharmonicWeights, OneHandleHoldsAll) {
  const auto out = solve(bar(4, 0.25), points({{0, 0, 0}}));
  EXPECT_NEAR((out.W.array() - 1).abs().maxCoeff(), 0, 1e-12);
}

// ---- at size
// Reports seconds of the clock and of the processor, the best of five, and asserts nothing of them: they are the machine's.
TEST(BoundedBiharmonicWeightsSlow, FiveThousandVerticesAndThirtyTwoHandles) {
  const TetMesh mesh = ball(0.132);
  ASSERT_GT(mesh.node_count(), 4900);
  const auto ids = place_handles(mesh, surface_nodes(mesh.tets), 32);
  for (const int threads : {1, 2}) {
    const sim::ThreadPool pool(threads);
    BiharmonicWeights out;
    double seconds = 1e9, processor = 1e9;
    for (int k = 0; k < 5; ++k) {
      const auto start = std::chrono::steady_clock::now();
      const std::clock_t start_processor = std::clock();
      out = solve(mesh, points(points_of(mesh, ids)), {.pool = &pool});
      processor = std::min(processor, static_cast<double>(std::clock() - start_processor) / CLOCKS_PER_SEC);
      seconds = std::min(seconds, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    EXPECT_TRUE(out.report.converged);
    EXPECT_LT(outside_simplex(out.W), 1e-9);
    EXPECT_LT(highest_stray_maximum(mesh, out.W, ids), 0.05);
    RecordProperty("processor_seconds_" + std::to_string(threads), std::to_string(processor));
    std::printf(
        "%d vertices, %d threads: %.2f s, processor %.2f s, %d iterations, %d factors, residuals %.1e %.1e, %.6g "
        "(%.6g)\n",
        mesh.node_count(), threads, seconds, processor, out.report.iterations, out.report.factors,
        out.report.primal_residual, out.report.dual_residual, out.report.energy, out.report.relaxed_energy);
  }
}

}  // namespace
}  // namespace crumple::authoring
