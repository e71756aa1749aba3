#include "server/sim/fracture/mesh_split.h"

#include "server/sim/fracture/fragments.h"
#include "tests/sim/fracture/uniform_stress.h"
#include "tests/support/kuhn_lattice.h"
#include "tests/support/shared_data.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <map>
#include <random>
#include <set>

namespace crumple::sim::fracture {
namespace {

// A body at rest with some velocity, and everything that a split must keep.
struct Body {
  explicit Body(const TetMesh& rest) : mesh(rest), stars(mesh.tets, mesh.node_count()) {
    state.x = mesh.X;
    for (const Vec3& x : mesh.X) state.v.push_back(Vec3(1, 2, 3) + Vec3(0.5, -1, 2).cross(x));
  }

  SplitReport split(std::span<const SplitCandidate> candidates, const SplitOptions& options) {
    SplitReport report = split_nodes(mesh.tets, state, stars, candidates, options);
    extend_by_origin(mesh.X, report.origin);
    return report;
  }

  TetMesh mesh;
  fem::FemState state;
  NodeStars stars;
};

struct Sums {
  double mass = 0;
  Vec3 moment = Vec3::Zero(), momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
};
Sums sums(const Body& body, const std::vector<double>& volumes) {
  std::vector<double> mass(body.state.x.size(), 0);
  for (int t = 0; t < body.mesh.tet_count(); ++t)
    for (const int n : body.mesh.tets[t]) mass[n] += 1000 * volumes[t] / 4;
  Sums s;
  for (std::size_t n = 0; n < mass.size(); ++n) {
    EXPECT_GT(mass[n], 0) << "node " << n << " belongs to no tet";
    s.mass += mass[n];
    s.moment += mass[n] * body.state.x[n];
    s.momentum += mass[n] * body.state.v[n];
    s.angular_momentum += mass[n] * body.state.x[n].cross(body.state.v[n]);
  }
  return s;
}
std::vector<double> volumes(const TetMesh& mesh) {
  std::vector<double> all(mesh.tet_count());
  for (int t = 0; t < mesh.tet_count(); ++t) all[t] = signed_volume(mesh, t);
  return all;
}

// Node ids of the tets of `star` that are connected through faces at `node`, by brute force: number of groups.
int groups_at(const std::vector<Tet>& tets, const std::vector<int>& star) {
  std::vector<int> group(star.size(), -1);
  int count = 0;
  for (std::size_t start = 0; start < star.size(); ++start) {
    if (group[start] >= 0) continue;
    std::vector<std::size_t> open{start};
    group[start] = count;
    while (!open.empty()) {
      const std::size_t i = open.back();
      open.pop_back();
      for (std::size_t j = 0; j < star.size(); ++j) {
        if (group[j] >= 0) continue;
        int shared = 0;
        for (const int n : tets[star[i]]) shared += std::ranges::count(tets[star[j]], n);
        if (shared < 3) continue;
        group[j] = count;
        open.push_back(j);
      }
    }
    ++count;
  }
  return count;
}

void expect_whole(const Body& body, const std::vector<double>& rest_volumes, const Sums& before) {
  EXPECT_TRUE(std::ranges::equal(volumes(body.mesh), rest_volumes));  // same rest geometry, to the bit
  for (const double v : rest_volumes) EXPECT_GT(v, 0);
  const Sums now = sums(body, rest_volumes);
  EXPECT_NEAR(now.mass, before.mass, 1e-12 * before.mass);
  EXPECT_LT((now.moment - before.moment).norm(), 1e-12 * before.mass);
  EXPECT_LT((now.momentum - before.momentum).norm(), 1e-11 * before.mass);
  EXPECT_LT((now.angular_momentum - before.angular_momentum).norm(), 1e-11 * before.mass);

  const Fragments fragments = find_fragments(body.mesh.tets);
  EXPECT_GE(std::ranges::min(fragments.size), kMinFragmentTets);
  std::vector<std::vector<int>> stars(body.mesh.node_count());
  for (int t = 0; t < body.mesh.tet_count(); ++t)
    for (const int n : body.mesh.tets[t]) stars[n].push_back(t);
  for (int n = 0; n < body.mesh.node_count(); ++n) {
    EXPECT_TRUE(std::ranges::equal(body.stars[n], stars[n]));
    EXPECT_EQ(groups_at(body.mesh.tets, stars[n]), 1) << "node " << n << " is a joint";
    for (const int t : stars[n]) EXPECT_EQ(fragments.of_tet[t], fragments.of_tet[stars[n][0]]);
  }
}

// `count` candidates at random nodes with random planes, 50 a call.
int split_at_random(Body& body, int count) {
  const auto rest_volumes = volumes(body.mesh);
  const Sums before = sums(body, rest_volumes);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  int splits = 0, refused = 0;
  for (int done = 0; done < count; done += 50) {
    std::map<int, SplitCandidate> candidates;
    while (candidates.size() < 50) {
      const int node = static_cast<int>(random() % body.mesh.node_count());
      candidates[node] = {node, Vec3(normal(random), normal(random), normal(random)).normalized(), 1};
    }
    std::vector<SplitCandidate> list;
    for (const auto& [node, candidate] : candidates) list.push_back(candidate);
    const SplitReport report = body.split(list, {.seed = 3, .step = static_cast<std::uint64_t>(done)});
    splits += static_cast<int>(report.splits.size());
    refused += report.refused;
    EXPECT_EQ(report.origin.size(), report.splits.size() + report.separated);
    if (done % 1000 == 0) expect_whole(body, rest_volumes, before);
  }
  expect_whole(body, rest_volumes, before);
  EXPECT_GT(refused, 0);
  return splits;
}

TEST(MeshSplit, TenThousandRandomSplitsOfALatticeLeaveWholePieces) {
  Body body(test::kuhn_lattice({8, 8, 8}, 0.125));
  const int splits = split_at_random(body, 10000);
  EXPECT_GT(splits, 800);
  EXPECT_GT(find_fragments(body.mesh.tets).count(), 200);
}

TEST(MeshSplit, TenThousandRandomSplitsOfTheBunnyLeaveWholePieces) {
  CRUMPLE_NEED_SHARED("yardstick/S09_bunny_hung/L0.json");
  std::ifstream file(test::shared_data("yardstick/S09_bunny_hung/L0.json"));
  const auto json = nlohmann::json::parse(file);
  TetMesh mesh;
  for (const auto& p : json["nodes"]) mesh.X.push_back(Vec3(p[0], p[1], p[2]));
  for (const auto& t : json["tets"]) mesh.tets.push_back(Tet{t[0], t[1], t[2], t[3]});
  ASSERT_TRUE(validate(mesh, "bunny"));
  Body body(mesh);
  EXPECT_GT(split_at_random(body, 10000), 1000);
}

constexpr std::array<int, 3> kBar{8, 2, 2};

std::vector<SplitCandidate> bar_candidates(const Body& body, double toughness) {
  const UniformStress field(body.mesh, uniaxial(Vec3::UnitX(), 1e4));
  return split_candidates(body.mesh.tets, body.stars, field.normals, field.S, toughness, false, field.pool);
}

TEST(MeshSplit, ABarPulledAboveItsStrengthComesApart) {
  Body body(test::kuhn_lattice(kBar, 0.1));
  const auto rest_volumes = volumes(body.mesh);
  const Sums before = sums(body, rest_volumes);
  EXPECT_TRUE(bar_candidates(body, 1.01e4).empty());
  const SplitReport report = body.split(bar_candidates(body, 0.99e4), {});
  EXPECT_GE(find_fragments(body.mesh.tets).count(), 2);
  for (const NodeSplit& split : report.splits) {
    EXPECT_NEAR(std::abs(split.normal.x()), 1, 1e-9);
    EXPECT_EQ(split.point, body.state.x[split.node]);
  }
  expect_whole(body, rest_volumes, before);
}

TEST(MeshSplit, APlaneThroughALatticeCutsItInTwo) {
  // All nodes of the middle cross-section, one plane: two halves that share no node.
  Body body(test::kuhn_lattice({4, 3, 3}, 1));
  std::vector<SplitCandidate> candidates;
  for (int n = 0; n < body.mesh.node_count(); ++n)
    if (body.mesh.X[n].x() == 2) candidates.push_back({n, Vec3::UnitX(), 1});
  const SplitReport report = body.split(candidates, {});
  EXPECT_EQ(report.origin.size(), candidates.size());
  std::set<int> origins(report.origin.begin(), report.origin.end());
  EXPECT_EQ(origins.size(), candidates.size());
  const Fragments fragments = find_fragments(body.mesh.tets);
  EXPECT_EQ(fragments.count(), 2);
  for (int t = 0; t < body.mesh.tet_count(); ++t) {
    double x = 0;
    for (const int n : body.mesh.tets[t]) x += body.mesh.X[n].x() / 4;
    EXPECT_EQ(fragments.of_tet[t], x < 2 ? 0 : 1);
  }
}

TEST(MeshSplit, APieceUnderThreeTetsIsRefused) {
  // One cube: six tets around its diagonal. A corner that one tet alone has cannot be cut off; a cut in half can.
  Body body(test::kuhn_lattice({1, 1, 1}, 1));
  body.split(std::vector<SplitCandidate>{{0, Vec3(1, -1, 0), 1}, {7, Vec3(1, -1, 0), 1}}, {});
  EXPECT_EQ(find_fragments(body.mesh.tets).size, (std::vector<int>{3, 3}));
  int nodes = body.mesh.node_count();
  for (int n = 0; n < nodes; ++n)
    for (const Vec3& e : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 2, 3), Vec3(-2, 1, 1)}) {
      const SplitReport report = body.split(std::vector<SplitCandidate>{{n, e, 1}}, {});
      EXPECT_TRUE(report.splits.empty());
    }
  EXPECT_EQ(body.mesh.node_count(), nodes);
  EXPECT_EQ(find_fragments(body.mesh.tets).count(), 2);
}

TEST(MeshSplit, ARefusedSplitChangesNothing) {
  Body body(test::kuhn_lattice({1, 1, 1}, 1));
  const auto tets = body.mesh.tets;
  // The plane leaves one of the six tets around the diagonal alone in front at node 0.
  const TetMesh& mesh = body.mesh;
  const Tet& tet = mesh.tets[0];
  Vec3 centroid = Vec3::Zero();
  for (const int n : tet) centroid += mesh.X[n] / 4;
  const Vec3 radial = centroid - centroid.dot(Vec3::Ones()) / 3 * Vec3::Ones();
  const double offset = 0.9 * radial.norm();
  const Vec3 e = (radial.normalized() - offset / centroid.dot(Vec3::Ones().normalized()) * Vec3::Ones().normalized());
  const SplitReport report = body.split(std::vector<SplitCandidate>{{0, e, 1}}, {});
  EXPECT_EQ(report.refused, 1);
  EXPECT_TRUE(report.splits.empty() && report.origin.empty());
  EXPECT_EQ(body.mesh.tets, tets);
  EXPECT_EQ(body.state.x.size(), 8u);
  for (int n = 0; n < 8; ++n) EXPECT_TRUE(std::ranges::equal(body.stars[n], NodeStars(tets, 8)[n]));
}

TEST(MeshSplit, HingesAndBallJointsAreParted) {
  // Two cubes side by side, cut at three of the four nodes they share: the fourth alone would be a ball joint. At two: a
  // hinge. (Splitting along the shared square cuts both its triangles as soon as the diagonal's ends have gone.)
  for (const int left_out : {1, 2}) {
    Body body(test::kuhn_lattice({2, 1, 1}, 1));
    std::vector<int> square;
    for (int n = 0; n < body.mesh.node_count(); ++n)
      if (body.mesh.X[n].x() == 1) square.push_back(n);
    // Ends of the square's diagonal first, so that every face is cut before the rest is looked at.
    std::ranges::stable_sort(square, {}, [&](int n) { return body.mesh.X[n].y() != body.mesh.X[n].z(); });
    std::vector<SplitCandidate> candidates;
    for (int i = 0; i + left_out < 4; ++i) candidates.push_back({square[i], Vec3::UnitX(), 1});
    const SplitReport report = body.split(candidates, {});
    EXPECT_EQ(find_fragments(body.mesh.tets).count(), 2);
    EXPECT_EQ(report.origin.size(), 4u);
    EXPECT_GE(report.separated, left_out);
    for (const auto& star : {body.stars[square[2]], body.stars[square[3]]})
      for (const int t : star) EXPECT_EQ(t < 6, star[0] < 6);
  }
}

TEST(MeshSplit, TheLimitOfAStepIsKept) {
  Body body(test::kuhn_lattice(kBar, 0.1));
  const auto candidates = bar_candidates(body, 0.5e4);
  ASSERT_GT(candidates.size(), 10u);
  EXPECT_EQ(body.split(candidates, {.max_splits = 7}).splits.size(), 7u);
  EXPECT_EQ(body.split(candidates, {.max_splits = 0}).splits.size(), 0u);
}

TEST(MeshSplit, CopiesKnowTheNodeOfBeforeTheCall) {
  Body body(test::kuhn_lattice({8, 4, 4}, 0.1));
  const int before = body.mesh.node_count();
  const SplitReport report = body.split(bar_candidates(body, 0.5e4), {});
  ASSERT_GT(report.separated, 0);
  std::vector<char> prescribed(before, 0);
  prescribed[report.origin[0]] = 1;
  const auto x = body.state.x;
  extend_by_origin(prescribed, report.origin);
  ASSERT_EQ(prescribed.size(), x.size());
  for (std::size_t i = 0; i < report.origin.size(); ++i) {
    EXPECT_LT(report.origin[i], before);
    EXPECT_EQ(x[before + i], x[report.origin[i]]);
    EXPECT_EQ(body.state.v[before + i], body.state.v[report.origin[i]]);
    EXPECT_EQ(prescribed[before + i], report.origin[i] == report.origin[0]);
  }
}

TEST(MeshSplit, TheSeedDecidesTheOrderAndNothingElseDoes) {
  const auto run = [](std::uint64_t seed, std::uint64_t step, bool reversed) {
    Body body(test::kuhn_lattice({8, 4, 4}, 0.1));
    auto candidates = bar_candidates(body, 0.5e4);
    if (reversed) std::ranges::reverse(candidates);
    std::vector<int> order;
    for (const NodeSplit& s : body.split(candidates, {.seed = seed, .step = step}).splits) order.push_back(s.node);
    return std::pair(order, body.mesh.tets);
  };
  const auto first = run(1, 5, false);
  EXPECT_EQ(first, run(1, 5, false));
  EXPECT_EQ(first, run(1, 5, true));
  EXPECT_NE(first.first, run(2, 5, false).first);
  EXPECT_NE(first.first, run(1, 6, false).first);
  EXPECT_FALSE(std::ranges::is_sorted(first.first));
}

}  // namespace
}  // namespace crumple::sim::fracture
