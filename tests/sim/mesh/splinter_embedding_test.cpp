#include "server/sim/mesh/splinter_embedding.h"

#include "server/sim/mesh/tet_tree.h"
#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace crumple::sim {
namespace {

// A tetrahedral splinter of a size around a point, appended.
void add_splinter(SplinterMesh& mesh, const Vec3& at, double size) {
  const int first = static_cast<int>(mesh.surface.vertices.size());
  for (const Vec3& corner : {Vec3(-1, -1, -1), Vec3(1, -1, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1)}) {
    mesh.surface.vertices.push_back(at + size / 2 * corner);
    mesh.splinter.push_back(mesh.count);
  }
  for (const Triangle& t : {Triangle{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    mesh.surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    mesh.patch.push_back(-1);
  }
  ++mesh.count;
}

// A bar of 4 x 1 x 1 unit cells with a splinter across the middle, x = 2, one nearer to the left of it, and one far away.
struct Bar {
  TetMesh mesh = test::kuhn_lattice({4, 1, 1}, 1);
  SplinterMesh splinters;
  SharedFaces faces{mesh.tets};
  std::vector<Tet> tets = mesh.tets;
  std::vector<Vec3> x = mesh.X;

  Bar() {
    add_splinter(splinters, Vec3(1.96, 0.52, 0.41), 0.3);
    add_splinter(splinters, Vec3(2.05, 0.31, 0.63), 0.3);
    add_splinter(splinters, Vec3(0.4, 0.5, 0.5), 0.2);
  }
  double middle(int t) const {
    double sum = 0;
    for (const int n : mesh.tets[t]) sum += mesh.X[n].x() / 4;
    return sum;
  }
  // Tets beyond x = 2 get nodes of their own there.
  void cut_nodes(const std::vector<int>& nodes) {
    for (const int node : nodes) {
      const int copy = static_cast<int>(x.size());
      x.push_back(Vec3(x[node]));
      for (int t = 0; t < mesh.tet_count(); ++t)
        if (middle(t) > 2) std::ranges::replace(tets[t], node, copy);
    }
  }
  std::vector<int> nodes_in_middle() const {
    std::vector<int> nodes;
    for (int n = 0; n < mesh.node_count(); ++n)
      if (mesh.X[n].x() == 2) nodes.push_back(n);
    return nodes;
  }
  // What is beyond the cut.
  void move_right(double by) {
    for (std::size_t n = 0; n < x.size(); ++n)
      if (n >= mesh.X.size() || mesh.X[n].x() > 2) x[n].x() += by;
  }
  std::vector<int> part() {
    return faces.part([&](int t) {
      std::array<std::uint64_t, 4> ids;
      std::ranges::copy(tets[t], ids.begin());
      return ids;
    });
  }
  std::vector<Vec3> positions(const SplinterEmbedding& embedding) const {
    std::vector<Vec3> out(splinters.surface.vertices.size());
    embedded_positions(embedding.vertices(), tets, x, out);
    return out;
  }
};

double worst_stretch(const SplinterMesh& mesh, const std::vector<Vec3>& x) {
  double worst = 0;
  for (const Triangle& t : mesh.surface.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      const double rest = (mesh.surface.vertices[a] - mesh.surface.vertices[b]).norm();
      worst = std::max(worst, std::abs((x[a] - x[b]).norm() / rest - 1));
    }
  return worst;
}

TEST(SplinterEmbedding, LiesWhereItsAuthorPutItAndFollowsTheMesh) {
  Bar bar;
  const SplinterEmbedding embedding = *SplinterEmbedding::make(bar.splinters, bar.mesh, bar.faces);
  Mat3 A;
  A << 1.2, 0.1, 0, -0.3, 0.9, 0.2, 0, 0.1, 1.1;
  for (Vec3& p : bar.x) p = A * p;
  const auto x = bar.positions(embedding);
  for (std::size_t v = 0; v < x.size(); ++v) EXPECT_LT((x[v] - A * bar.splinters.surface.vertices[v]).norm(), 1e-14);
}

TEST(SplinterEmbedding, StaysWholeOnTheSideOfItsCentroidWhenTheBarParts) {
  Bar bar;
  SplinterEmbedding embedding = *SplinterEmbedding::make(bar.splinters, bar.mesh, bar.faces);
  bar.cut_nodes(bar.nodes_in_middle());
  const std::vector<int> parted = bar.part();
  EXPECT_EQ(parted.size(), 2u);
  embedding.follow(bar.faces, parted);
  bar.move_right(5);
  const auto x = bar.positions(embedding);
  EXPECT_LT(worst_stretch(bar.splinters, x), 1e-12);
  for (int v = 0; v < 4; ++v) EXPECT_LT(x[v].x(), 2.5);   // the first stays
  for (int v = 4; v < 8; ++v) EXPECT_GT(x[v].x(), 6.5);   // the second goes
}

TEST(SplinterEmbedding, OneThatReachesOutOfTheTetsLosesNoneOfThemAtRest) {
  Bar bar;
  SplinterMesh large;
  add_splinter(large, Vec3(2.1, 0.6, 0.4), 3);
  const SplinterEmbedding embedding = *SplinterEmbedding::make(large, bar.mesh, bar.faces);
  const Embedding nearest = embed(large.surface.vertices, bar.mesh);
  EXPECT_EQ(embedding.vertices().tet, nearest.tet);
}

TEST(SplinterEmbedding, WithoutReassociationItWouldBeDrawnOut) {
  Bar bar;
  const SplinterEmbedding embedding = *SplinterEmbedding::make(bar.splinters, bar.mesh, bar.faces);  // does not follow
  bar.cut_nodes(bar.nodes_in_middle());
  bar.move_right(5);
  EXPECT_GT(worst_stretch(bar.splinters, bar.positions(embedding)), 3);
}

TEST(SplinterEmbedding, TheOrderInWhichFacesPartDoesNotMatter) {
  Bar first, second;
  SplinterEmbedding at_once = *SplinterEmbedding::make(first.splinters, first.mesh, first.faces);
  SplinterEmbedding by_turns = *SplinterEmbedding::make(second.splinters, second.mesh, second.faces);
  const std::vector<int> nodes = first.nodes_in_middle();
  first.cut_nodes(nodes);
  at_once.follow(first.faces, first.part());
  for (std::size_t k = nodes.size(); k-- > 0;) {
    second.cut_nodes({nodes[k]});
    by_turns.follow(second.faces, second.part());
  }
  EXPECT_EQ(at_once.vertices().tet, by_turns.vertices().tet);
  EXPECT_EQ(at_once.vertices().weights, by_turns.vertices().weights);
}

// Two bricks, [low, 2.1] and [2.1, high] along the bar, across the cut at x = 2 or beside it: their faces at 2.1 lie on each other.
SplinterMesh two_bricks(double low, double high) {
  SplinterMesh mesh;
  const auto add = [&](double from, double to, int across) {
    const int first = static_cast<int>(mesh.surface.vertices.size());
    for (const double x : {from, to})
      for (const Vec3& p : {Vec3(x, 0.2, 0.3), Vec3(x, 0.8, 0.3), Vec3(x, 0.5, 0.8)}) mesh.surface.vertices.push_back(p);
    mesh.splinter.resize(mesh.surface.vertices.size(), mesh.count);
    for (const Triangle& t : {Triangle{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}}) {
      mesh.surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      mesh.patch.push_back(static_cast<int>(mesh.surface.triangles.size()) - 1 == across ? mesh.count : -1);
    }
    mesh.patches.push_back({mesh.count, {1 - mesh.count}});
    ++mesh.count;
  };
  add(low, 2.1, 1);
  add(2.1, high, 8);
  return mesh;
}

TEST(SplinterEmbedding, FacesBetweenSplintersAreHiddenUntilACrackPartsThem) {
  for (const bool apart : {false, true}) {
    Bar bar;
    const SplinterMesh mesh = two_bricks(apart ? 1.5 : 2.05, 2.4);  // the first is at home left of the cut, or right as the second
    ASSERT_TRUE(validate(mesh, "mesh")) << validate(mesh, "mesh").error().text();
    SplinterEmbedding embedding = *SplinterEmbedding::make(mesh, bar.mesh, bar.faces);
    EXPECT_TRUE(embedding.is_hidden(0) && embedding.is_hidden(1));
    bar.cut_nodes(bar.nodes_in_middle());
    embedding.follow(bar.faces, bar.part());
    EXPECT_EQ(embedding.is_hidden(0), !apart);
    EXPECT_EQ(embedding.is_hidden(1), !apart);
  }
}

TEST(SharedFaces, EachInnerFaceOfALatticeIsSharedOnceAndPartsOnce) {
  const TetMesh mesh = test::kuhn_lattice({3, 2, 2}, 1);
  SharedFaces faces(mesh.tets);
  EXPECT_EQ(2 * faces.count() + static_cast<int>(surface_faces(mesh.tets).size()), 4 * mesh.tet_count());
  const auto apart = [&](int t) {  // each tet for itself
    const auto id = 4 * static_cast<std::uint64_t>(t);
    return std::array<std::uint64_t, 4>{id, id + 1, id + 2, id + 3};
  };
  EXPECT_EQ(static_cast<int>(faces.part(apart).size()), faces.count());
  EXPECT_TRUE(faces.part(apart).empty());
}

TEST(TetTree, NearFindsAllTetsWhoseBoxesMeet) {
  const TetMesh mesh = test::kuhn_lattice({4, 3, 5}, 0.25);
  const TetTree tree(mesh);
  const Eigen::AlignedBox3d box(Vec3(0.3, 0.1, 0.4), Vec3(0.6, 0.3, 0.9));
  std::vector<int> expected;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    Eigen::AlignedBox3d own;
    for (const int n : mesh.tets[t]) own.extend(mesh.X[n]);
    if (own.intersects(box)) expected.push_back(t);
  }
  EXPECT_GT(expected.size(), 20u);
  EXPECT_EQ(tree.near(box), expected);
}

}  // namespace
}  // namespace crumple::sim
