#include "server/authoring/splinter_cut.h"

#include "server/authoring/glass_shards.h"
#include "server/authoring/polygon_triangles.h"
#include "server/authoring/shapes/barrel.h"
#include "server/authoring/shapes/surfaces.h"
#include "tests/authoring/surfaces_for_tests.h"
#include "tests/support/kuhn_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace crumple::authoring {
namespace {

using ::testing::HasSubstr;
using Box = Eigen::AlignedBox3d;

Polyhedron solid(const sim::SurfaceMesh& surface) { return *polyhedron_of(surface); }

bool is_closed(const Polyhedron& solid) {
  std::map<std::pair<int, int>, int> open;
  for (const Polyhedron::Face& face : solid.faces)
    for (const std::vector<int>& loop : face.loops)
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const int a = loop[k], b = loop[(k + 1) % loop.size()];
        open[std::minmax(a, b)] += a < b ? 1 : -1;
      }
  return std::ranges::all_of(open, [](const auto& edge) { return edge.second == 0; });
}

// A square frame: 3 x 3 x 1 unit cells without the one in the middle, from the origin.
sim::SurfaceMesh frame() {
  sim::TetMesh mesh = test::kuhn_lattice({3, 3, 1}, 1);
  std::erase_if(mesh.tets, [&](const Tet& tet) {
    Vec3 middle = Vec3::Zero();
    for (const int n : tet) middle += mesh.X[n] / 4;
    return middle.x() > 1 && middle.x() < 2 && middle.y() > 1 && middle.y() < 2;
  });
  return surface_of(mesh);
}

Box box_of(const sim::SurfaceMesh& surface) {
  Box box;
  for (const Vec3& p : surface.vertices) box.extend(p);
  return box;
}

double area(const sim::SurfaceMesh& mesh, const Triangle& t) {
  return 0.5 * (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
}

double outside_area(const sim::SplinterMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.patch.size(); ++t)
    if (mesh.patch[t] < 0) sum += area(mesh.surface, mesh.surface.triangles[t]);
  return sum;
}

double outside_area(const sim::SurfaceMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += area(mesh, t);
  return sum;
}

// What cannot go wrong: the pieces are the whole, and between them there is nothing.
void expect_partition(const sim::SplinterMesh& mesh, const sim::SurfaceMesh& whole) {
  ASSERT_TRUE(sim::validate(mesh, "splinters")) << sim::validate(mesh, "splinters").error().text();
  EXPECT_NEAR(enclosed_volume(mesh.surface), enclosed_volume(whole), 1e-9 * std::abs(enclosed_volume(whole)));
  EXPECT_NEAR(outside_area(mesh), outside_area(whole), 1e-6 * outside_area(whole));  // pieces of no volume are left out
  std::vector<Vec3> across(mesh.count, Vec3::Zero());  // area vectors of each piece: closed if they sum to zero
  for (const Triangle& t : mesh.surface.triangles) {
    const auto& p = mesh.surface.vertices;
    across[mesh.splinter[t[0]]] += (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]);
  }
  for (const Vec3& sum : across) EXPECT_LT(sum.norm(), 1e-9 * outside_area(whole));
}

// What i shows to j is as large as what j shows to i.
void expect_patches_match(const sim::SplinterMesh& mesh) {
  std::vector<double> size(mesh.patches.size(), 0);
  for (std::size_t t = 0; t < mesh.patch.size(); ++t)
    if (mesh.patch[t] >= 0) size[mesh.patch[t]] += area(mesh.surface, mesh.surface.triangles[t]);
  std::map<std::pair<int, int>, double> between;
  std::vector<char> several(mesh.count, 0);  // has a patch against parts of a cell that is in several
  for (std::size_t p = 0; p < size.size(); ++p) {
    const auto& [own, others] = mesh.patches[p];
    between[{own, others[0]}] += size[p];
    if (others.size() > 1) several[own] = several[others[0]] = several[others[1]] = 1;
  }
  EXPECT_LT(std::ranges::count(several, 1), 0.25 * mesh.count);
  double all = 0;
  for (const auto& [pair, sum] : between) all += sum;
  for (const auto& [pair, sum] : between) {
    if (several[pair.first] || several[pair.second]) continue;
    const auto back = between.find({pair.second, pair.first});
    if (back == between.end()) {
      EXPECT_LT(sum, 1e-6 * all);
      continue;
    }
    EXPECT_NEAR(sum, back->second, 1e-6 * all);
  }
}

TEST(Polyhedron, ACornerCutOffACubeHasItsVolume) {
  const Polyhedron cut = clip(solid(box_surface(Vec3::Constant(0.5))), -Vec3::Ones(), 1, 7);  // x + y + z >= -1
  EXPECT_NEAR(volume(cut), 1 - 0.125 / 6, 1e-15);
  EXPECT_TRUE(is_closed(cut));
  ASSERT_EQ(cut.faces.back().label, 7);
  double cap = 0;
  for (const Triangle& t : triangles_of(cut.points, cut.faces.back().loops))
    cap += 0.5 * (cut.points[t[1]] - cut.points[t[0]]).cross(cut.points[t[2]] - cut.points[t[0]]).norm();
  EXPECT_NEAR(cap, std::sqrt(3) / 4 * 0.5, 1e-15);  // equilateral, of side sqrt(0.5)
}

TEST(Polyhedron, APlaneThatMissesOrTouchesLeavesAllOrNothing) {
  const Polyhedron cube = solid(box_surface(Vec3::Constant(0.5)));
  EXPECT_EQ(clip(cube, Vec3::UnitX(), 0.5, 1).faces.size(), cube.faces.size());
  EXPECT_TRUE(clip(cube, Vec3::UnitX(), -0.6, 1).is_empty());
  EXPECT_EQ(volume(clip(cube, Vec3::UnitX(), -0.5, 1)), 0);
}

TEST(Polyhedron, ACutThroughAFrameLeavesAFaceWithAHole) {
  const Polyhedron cut = clip(solid(frame()), Vec3::UnitZ(), 0.3, 5);
  EXPECT_NEAR(volume(cut), 8 * 0.3, 1e-14);
  EXPECT_TRUE(is_closed(cut));
  const Polyhedron::Face& cap = cut.faces.back();
  ASSERT_EQ(cap.label, 5);
  EXPECT_EQ(cap.loops.size(), 2u);
  double sum = 0;
  for (const Triangle& t : triangles_of(cut.points, cap.loops)) {
    const double z = (cut.points[t[1]] - cut.points[t[0]]).cross(cut.points[t[2]] - cut.points[t[0]]).z() / 2;
    EXPECT_GT(z, -1e-12);
    sum += z;
  }
  EXPECT_NEAR(sum, 8, 1e-12);
}

// Cuts that go exactly through vertices, edges and faces leave several points in one place.
TEST(Polyhedron, FacesCutThroughVerticesDoNotFold) {
  sim::TetMesh lattice = test::kuhn_lattice({4, 4, 2}, 1);
  std::erase_if(lattice.tets, [&](const Tet& tet) {  // an L
    Vec3 middle = Vec3::Zero();
    for (const int n : tet) middle += lattice.X[n] / 4;
    return middle.x() > 2 && middle.y() > 1;
  });
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, 1, 0).normalized().eval(), Vec3(0, 1, 1).normalized().eval()}) {
    for (const double at : {1.0, 2.0, 1.0 + 1e-15}) {
      const Polyhedron cut = clip(solid(surface_of(lattice)), normal, normal.dot(Vec3(at, at, 1)), 3);
      EXPECT_TRUE(is_closed(cut));
      for (const Polyhedron::Face& face : cut.faces) {
        Vec3 sum = Vec3::Zero();
        double all = 0;
        for (const Triangle& t : triangles_of(cut.points, face.loops)) {
          const Vec3 n = 0.5 * (cut.points[t[1]] - cut.points[t[0]]).cross(cut.points[t[2]] - cut.points[t[0]]);
          sum += n;
          all += n.norm();
        }
        EXPECT_NEAR(all, sum.norm(), 1e-9) << normal.transpose() << " at " << at;
      }
    }
  }
}

TEST(Polyhedron, StaysClosedUnderAHundredCuts) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  for (const sim::SurfaceMesh& surface : {icosphere(1, 2), frame(), barrel_surface(BarrelShape())}) {
    Polyhedron rest = solid(surface);
    const Box box = box_of(surface);
    for (int k = 0; k < 100 && !rest.is_empty(); ++k) {
      const Vec3 normal = Vec3(number(random), number(random), number(random)).normalized();
      const Vec3 at = box.center() + 0.4 * (0.5 + std::abs(number(random))) * box.sizes().norm() * normal;
      const double before = volume(rest);
      const Polyhedron other = clip(rest, -normal, -normal.dot(at), 1);
      rest = clip(std::move(rest), normal, normal.dot(at), 1);
      EXPECT_NEAR(volume(rest) + volume(other), before, 1e-12);
      ASSERT_TRUE(is_closed(rest) && is_closed(other)) << k;
    }
  }
}

TEST(Polyhedron, AnOpenSurfaceIsRefusedWithTheNumberOfItsOpenEdges) {
  sim::SurfaceMesh open = box_surface(Vec3::Ones());
  open.triangles.pop_back();
  const auto made = polyhedron_of(open);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("has 3 edges at which its triangles do not meet in pairs"));
}

TEST(PolygonTriangles, AStarAndACombKeepTheirArea) {
  std::vector<Vec3> points;
  std::vector<int> star, comb;
  for (int k = 0; k < 10; ++k) {
    const double r = k % 2 == 0 ? 1 : 0.3, a = k * std::numbers::pi / 5;
    star.push_back(static_cast<int>(points.size()));
    points.emplace_back(r * std::cos(a), 5, -r * std::sin(a));  // counter-clockwise about y
  }
  for (const auto& [x, z] : {std::pair{0, 0}, {0, 3}, {1, 3}, {1, 1}, {2, 1}, {2, 3}, {3, 3}, {3, 1}, {4, 1}, {4, 3}, {5, 3}, {5, 0}}) {
    comb.push_back(static_cast<int>(points.size()));
    points.emplace_back(x, 5, z);
  }
  const auto sum = [&](const std::vector<int>& loop) {
    Vec3 twice = Vec3::Zero();
    for (const Triangle& t : triangles_of(points, {loop})) {
      const Vec3 n = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
      EXPECT_GT(n.y(), 0);
      twice += n;
    }
    return twice.y() / 2;
  };
  EXPECT_NEAR(sum(star), 10 * 0.5 * 0.3 * std::sin(std::numbers::pi / 5), 1e-12);
  EXPECT_NEAR(sum(comb), 11, 1e-12);
}

TEST(SplinterCut, StonePiecesAreTheWholeOfCubesSpheresFramesAndBarrels) {
  for (const sim::SurfaceMesh& surface : {box_surface(Vec3(0.5, 0.3, 0.4)), icosphere(0.5, 3), frame(), barrel_surface(BarrelShape())}) {
    const Box box = box_of(surface);
    const auto cells = stone_cells(box, box.sizes().maxCoeff() / 6, 4);
    ASSERT_TRUE(cells);
    const sim::SplinterMesh mesh = *cut_splinters(solid(surface), *cells);
    EXPECT_GT(mesh.count, 30);
    expect_partition(mesh, surface);
    expect_patches_match(mesh);
  }
}

TEST(SplinterCut, StoneCellsTileTheirBoxAndShareTheirWalls) {
  const Box box(Vec3(1, 2, 3), Vec3(5.3, 5.1, 5.6));
  const auto cells = stone_cells(box, 1, 9);
  ASSERT_TRUE(cells);
  ASSERT_GE(cells->size(), 40u);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p = box.min() + Vec3(number(random), number(random), number(random)).cwiseProduct(box.sizes());
    int holding = 0;
    for (const SplinterCell& cell : *cells) {
      if (cell.box.isEmpty()) continue;  // of a site beyond the box
      const bool inside = std::ranges::all_of(cell.walls, [&](const SplinterCell::Wall& w) { return w.normal.dot(p) <= w.offset; });
      holding += inside;
      if (inside) EXPECT_LT(cell.box.exteriorDistance(p), 1e-12);
    }
    EXPECT_EQ(holding, 1) << p.transpose();
  }
  for (std::size_t c = 0; c < cells->size(); ++c) {
    for (const SplinterCell::Wall& wall : (*cells)[c].walls) {
      ASSERT_EQ(wall.neighbours.size(), 1u);
      const auto& back = (*cells)[wall.neighbours[0]].walls;
      const auto same = std::ranges::find_if(back, [&](const SplinterCell::Wall& w) { return w.neighbours[0] == static_cast<int>(c); });
      ASSERT_NE(same, back.end());
      EXPECT_LT((same->normal + wall.normal).norm(), 1e-12);
      EXPECT_NEAR(same->offset, -wall.offset, 1e-12);
    }
  }
}

TEST(SplinterCut, PartsThatDoNotTouchAreSplintersOfTheirOwn) {
  sim::SurfaceMesh posts = box_surface(Vec3(0.2, 1, 0.2));
  append(posts, box_surface(Vec3(0.2, 1, 0.2)), Pose{Quat::Identity(), Vec3(2, 0, 0)});
  const sim::SplinterMesh mesh = *cut_splinters(solid(posts), *brick_cells(box_of(posts), Vec3(40, 1, 40)));
  EXPECT_EQ(mesh.count, 4);
  expect_partition(mesh, posts);
  expect_patches_match(mesh);
}

TEST(SplinterCut, CavitiesBelongToWhatIsAroundThem) {
  sim::SurfaceMesh hollow = box_surface(Vec3::Constant(1));
  sim::SurfaceMesh inner = box_surface(Vec3::Constant(0.2));
  for (Triangle& t : inner.triangles) std::swap(t[1], t[2]);
  append(hollow, inner);
  for (const double size : {3.0, 0.5}) {
    const sim::SplinterMesh mesh = *cut_splinters(solid(hollow), *stone_cells(box_of(hollow), size, 1));
    EXPECT_NEAR(enclosed_volume(mesh.surface), 8 - 0.064, 1e-12);
    EXPECT_NEAR(outside_area(mesh), 24 + 6 * 0.16, 1e-9);
  }
}

TEST(SplinterCut, WhatIsSmallBesideItsCellIsKept) {
  sim::SurfaceMesh with_bolt = box_surface(Vec3::Constant(1));
  append(with_bolt, box_surface(Vec3::Constant(5e-4)), Pose{Quat::Identity(), Vec3(1.5, 0, 0)});
  EXPECT_EQ(cut_splinters(solid(with_bolt), *stone_cells(box_of(with_bolt), 4, 1))->count, 2);
  const sim::SurfaceMesh cube = box_surface(Vec3::Constant(0.04));
  EXPECT_EQ(cut_splinters(solid(cube), *brick_cells(box_of(cube), Vec3::Constant(100)))->count, 1);
}

TEST(SplinterCut, AnInsideOutSurfaceIsRefused) {
  sim::SurfaceMesh cube = box_surface(Vec3::Constant(1));
  for (Triangle& t : cube.triangles) std::swap(t[1], t[2]);
  const auto made = polyhedron_of(cube);
  ASSERT_FALSE(made);
  EXPECT_THAT(made.error().message, HasSubstr("encloses -8 m^3, must be above 0"));
}

TEST(SplinterCut, WoodOfASlantedGrainCountsWhatIsInTheBody) {
  const auto cells = wood_cells(Box(Vec3(-1, -1, -0.02), Vec3(1, 1, 0.02)), 0.02, 10, Vec3(1, 1, 1).normalized(), 1);
  ASSERT_TRUE(cells) << cells.error().text();
  EXPECT_LT(cells->size(), 40'000u);
}

TEST(SplinterCut, GlassShardsGoThroughTheSheet) {
  const sim::SurfaceMesh pane = box_surface(Vec3(1, 0.8, 0.02));
  const auto cells = glass_cells(box_of(pane), 0.1, 1);
  ASSERT_TRUE(cells);
  const sim::SplinterMesh mesh = *cut_splinters(solid(pane), *cells);
  EXPECT_GT(mesh.count, 20 * 16);  // none is larger than 0.1^2
  EXPECT_LT(mesh.count, 2 * 20 * 16);
  expect_partition(mesh, pane);
  std::vector<Box> box(mesh.count);
  for (std::size_t v = 0; v < mesh.splinter.size(); ++v) box[mesh.splinter[v]].extend(mesh.surface.vertices[v]);
  for (const Box& b : box) EXPECT_NEAR(b.sizes().z(), 0.04, 1e-12);
}

TEST(GlassShards, TileTheirRectangleAndKnowEachOther) {
  const auto shards = glass_shards({-1, 0}, {2, 1.5}, 0.1, 5);
  double sum = 0, largest = 0, pointed = 0;
  for (const Shard& shard : shards) {
    double area = 0;
    const std::size_t n = shard.corners.size();
    for (std::size_t k = 0; k < n; ++k) {
      const Eigen::Vector2d &a = shard.corners[k], &b = shard.corners[(k + 1) % n], &c = shard.corners[(k + 2) % n];
      area += 0.5 * (a.x() * b.y() - a.y() * b.x());
      pointed += (a - b).normalized().dot((c - b).normalized()) > 0.5;  // under 60 degrees
    }
    sum += area;
    largest = std::max(largest, area);
  }
  EXPECT_NEAR(sum, 4.5, 1e-12);
  EXPECT_LE(largest, 0.01);
  EXPECT_GT(pointed, 0.5 * static_cast<double>(shards.size()));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(0, 1);
  for (int k = 0; k < 3000; ++k) {  // on a short way from one shard over an edge of it, a neighbour comes next
    const int own = static_cast<int>(random() % shards.size());
    const Shard& shard = shards[own];
    const std::size_t e = random() % shard.edges.size();
    if (shard.edges[e].neighbours.empty()) continue;
    const double s = number(random);
    const Eigen::Vector2d over = (1 - s) * shard.corners[e] + s * shard.corners[(e + 1) % shard.corners.size()] + 1e-7 * shard.edges[e].normal;
    const auto holds = [&](int other) {
      return std::ranges::all_of(shards[other].edges, [&](const Shard::Edge& edge) { return edge.normal.dot(over) <= edge.offset; });
    };
    EXPECT_TRUE(std::ranges::any_of(shard.edges[e].neighbours, holds));
  }
}

TEST(SplinterCut, WoodComesApartAlongItsGrain) {
  const sim::SurfaceMesh beam = box_surface(Vec3(0.1, 1, 0.1));
  const auto cells = wood_cells(box_of(beam), 0.05, 8, Vec3::UnitY(), 1);
  ASSERT_TRUE(cells);
  const sim::SplinterMesh mesh = *cut_splinters(solid(beam), *cells);
  expect_partition(mesh, beam);
  std::vector<Box> box(mesh.count);
  for (std::size_t v = 0; v < mesh.splinter.size(); ++v) box[mesh.splinter[v]].extend(mesh.surface.vertices[v]);
  double along = 0, across = 0;
  for (const Box& b : box) along += b.sizes().y(), across += b.sizes().x();
  EXPECT_GT(along, 5 * across);
}

TEST(SplinterCut, BricksLieInABond) {
  const sim::SurfaceMesh wall = box_surface(Vec3(1, 0.5, 0.1));
  const auto cells = brick_cells(box_of(wall), Vec3(0.4, 0.2, 0.2));
  ASSERT_TRUE(cells);
  const sim::SplinterMesh mesh = *cut_splinters(solid(wall), *cells);
  EXPECT_EQ(mesh.count, 3 * 5 + 2 * 6);  // whole ones in three courses; five and two halves in the others, less what is outside
  expect_partition(mesh, wall);
  for (const auto& patch : mesh.patches) EXPECT_LE(patch.others.size(), 2u);
  double hidden = 0;
  for (std::size_t t = 0; t < mesh.patch.size(); ++t)
    if (mesh.patch[t] >= 0) hidden += area(mesh.surface, mesh.surface.triangles[t]);
  EXPECT_NEAR(hidden, 2 * (4 * 2 * 0.2 + (3 * 4 + 2 * 5) * 0.2 * 0.2), 1e-9);  // both sides of bed and head joints
}

TEST(SplinterCut, TooManyPiecesAreRefused) {
  const auto cells = stone_cells(Box(Vec3::Zero(), Vec3::Ones()), 0.01, 1);
  ASSERT_FALSE(cells);
  EXPECT_EQ(cells.error().field, "size");
  EXPECT_THAT(cells.error().message, HasSubstr("1e+06 splinters, must make at most 100000"));
}

TEST(SplinterCut, GivenPiecesAreKeptAndKnowWhereTheyTouch) {
  sim::SurfaceMesh two;
  two.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, -1}};
  two.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {6, 5, 4}, {5, 6, 7}, {4, 5, 7}, {6, 4, 7}};
  const sim::SplinterMesh mesh = given_splinters(two);
  ASSERT_TRUE(sim::validate(mesh, "mesh"));
  EXPECT_EQ(mesh.count, 2);
  EXPECT_EQ(mesh.surface.triangles, two.triangles);
  EXPECT_EQ(std::ranges::count(mesh.patch, -1), 6);  // all but the face between them, which is drawn from neither side
  ASSERT_GE(mesh.patch[0], 0);
  ASSERT_GE(mesh.patch[4], 0);
  EXPECT_EQ(mesh.patches[mesh.patch[0]].others, std::vector{1});
  EXPECT_EQ(mesh.patches[mesh.patch[4]].others, std::vector{0});
}

TEST(SplinterCut, TheSameSeedMakesTheSamePieces) {
  const sim::SurfaceMesh cube = box_surface(Vec3::Constant(0.5));
  const auto cut = [&](std::uint64_t seed) { return *cut_splinters(solid(cube), *stone_cells(box_of(cube), 0.25, seed)); };
  EXPECT_EQ(cut(3).surface.vertices, cut(3).surface.vertices);
  EXPECT_NE(cut(3).surface.vertices, cut(4).surface.vertices);
}

}  // namespace
}  // namespace crumple::authoring
