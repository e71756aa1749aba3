#include "server/authoring/prescored_parts.h"

#include "server/authoring/barrel_asset.h"
#include "server/authoring/bounded_biharmonic_weights.h"
#include "server/authoring/car_asset.h"
#include "server/authoring/convex_parts.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/pose_fit.h"
#include "server/authoring/prescoring_cells.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/authoring/splinter_cut.h"
#include "server/authoring/tet_connectivity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

namespace crumple::authoring {
namespace {

using sim::TetMesh;
using sim::example_based::ExampleSet;
using ::testing::HasSubstr;
using Box = Eigen::AlignedBox3d;

Box box_of(const TetMesh& mesh) {
  Box box;
  for (const Vec3& X : mesh.X) box.extend(X);
  return box;
}

double volume_of(const TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += sim::signed_volume(mesh, t);
  return sum;
}

// A rigged mesh with a bent pose, one hull, and its own surface drawn.
ExampleSet rigged(const TetMesh& mesh, int handles = 6) {
  ExampleSet set;
  set.mesh = mesh;
  const auto surface = surface_nodes(mesh.tets);
  const auto points = points_of(mesh, place_handles(mesh, surface, handles));
  Handles all;
  for (const Vec3& p : points) {
    all.handles.push_back(Handle::point(p));
    set.handles.push_back({"handle " + std::to_string(set.handles.size()), p});
  }
  set.W = bounded_biharmonic_weights(mesh, all)->W;
  const PoseField bend = kink({.axis = Vec3::UnitX(), .hinge = Vec3::UnitZ(), .angle = 1, .width = 0.4});
  set.examples = {rest_example(handles), fit_example("bent", set.W, mesh.X, points, bend, BoneRotations::follow_field)};
  set.convex_parts = {surface};
  set.render = surface_of(mesh);
  for (const Vec3& X : mesh.X) set.alpha_scale.push_back(2 + X.x());
  return set;
}

ExampleSet bar() { return rigged(*centred_box_mesh({2, 1, 1}, {8, 4, 4}, Lattice::bcc)); }

// A square arch: the middle third of the lower half is missing.
TetMesh arch() {
  TetMesh mesh = *box_mesh({.size = {3, 2, 1}, .cells = {6, 4, 2}, .minimum = Vec3::Zero()});
  std::erase_if(mesh.tets, [&](const Tet& tet) {
    Vec3 middle = Vec3::Zero();
    for (const int i : tet) middle += mesh.X[i] / 4;
    return middle.x() > 1 && middle.x() < 2 && middle.y() < 1;
  });
  std::vector<int> id(mesh.X.size(), -1);  // no node without a tet
  TetMesh out;
  for (Tet tet : mesh.tets) {
    for (int& i : tet) {
      if (id[i] < 0) id[i] = out.node_count(), out.X.push_back(mesh.X[i]);
      i = id[i];
    }
    out.tets.push_back(tet);
  }
  return out;
}

Vec3 posed(const ExampleSet& set, int example, int v) {
  Vec3 x = Vec3::Zero();
  for (int b = 0; b < set.bone_count(); ++b) {
    const auto& bone = set.examples[example].bones[b];
    x += set.W(v, b) * (bone.q * set.mesh.X[v] + bone.t);
  }
  return x;
}

// Without joining what is small, unless asked for.
PrescoredAsset broken(const ExampleSet& set, const std::vector<SplinterCell>& cells, double least_part = 0) {
  auto out = prescored_parts(set, cells, {.least_part = least_part});
  EXPECT_TRUE(out) << out.error().text();
  return out ? std::move(*out) : PrescoredAsset{};
}

// What holds of every asset that is cut, whatever the cells: parts are whole, their rigs are the asset's, and those
// that share a face move together.
void expect_consistent(const ExampleSet& set, const PrescoredAsset& asset) {
  double volume = 0;
  for (const PrescoredPart& part : asset.parts) {
    volume += part.volume;
    EXPECT_NEAR(part.volume, volume_of(part.set.mesh), 1e-12 * part.volume);
    EXPECT_EQ(face_parts(face_neighbours(part.set.mesh.tets)).count, 1);  // hangs together, face to face
    EXPECT_LT((part.set.W.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-9);
    EXPECT_GE(part.set.W.minCoeff(), 0);
    EXPECT_EQ(part.set.example_count(), set.example_count());
    ASSERT_EQ(part.set.handles.size(), set.handles.empty() ? 0 : part.bones.size());
    for (std::size_t b = 0; b < part.set.handles.size(); ++b) {
      EXPECT_EQ(part.set.handles[b].name, set.handles[part.bones[b]].name);
      EXPECT_EQ(part.set.handles[b].position, set.handles[part.bones[b]].position);
    }
    for (int e = 0; e < set.example_count(); ++e)
      for (std::size_t b = 0; b < part.bones.size(); ++b) {
        EXPECT_EQ(part.set.examples[e].bones[b].q.coeffs(), set.examples[e].bones[part.bones[b]].q.coeffs());
        EXPECT_EQ(part.set.examples[e].bones[b].t, set.examples[e].bones[part.bones[b]].t);
      }
  }
  EXPECT_NEAR(volume, volume_of(set.mesh), 1e-9 * volume);

  for (const PrescoredFace& face : asset.faces) {
    EXPECT_LT(face.a, face.b);
    EXPECT_GT(face.area, 0);
    EXPECT_NEAR(face.normal.norm(), 1, 1e-12);
    const TetMesh &a = asset.parts[face.a].set.mesh, &b = asset.parts[face.b].set.mesh;
    int shared = 0;
    for (int v = 0; v < a.node_count(); ++v)
      for (int w = 0; w < b.node_count(); ++w)
        if ((a.X[v] - b.X[w]).norm() < 1e-9) {
          ++shared;
          for (int e = 0; e < set.example_count(); ++e)
            EXPECT_LT((posed(asset.parts[face.a].set, e, v) - posed(asset.parts[face.b].set, e, w)).norm(), 1e-6);
        }
    EXPECT_GE(shared, 3) << face.a << " " << face.b;
  }
}

// ---- cells
TEST(PrescoringCells, PlanesFillTheBoxAndKnowTheirNeighbours) {
  const Box box(Vec3(-1, -1, -1), Vec3(1, 2, 1));
  const auto cells = plane_cells(box, {{Vec3::UnitX(), 0.25}, {Vec3(1, 1, 0), 0.3}, {Vec3(0, 0, 2), 5}});
  ASSERT_TRUE(cells) << cells.error().text();
  ASSERT_EQ(cells->size(), 4u);  // the third misses the box
  double sum = 0;
  for (std::size_t c = 0; c < cells->size(); ++c) {
    Polyhedron solid = polyhedron_of(box);
    for (const auto& wall : (*cells)[c].walls) {
      solid = clip(std::move(solid), wall.normal, wall.offset, 0);
      for (const int other : wall.neighbours) {  // whose wall it is, too, seen from behind
        const auto& theirs = (*cells)[other].walls;
        EXPECT_TRUE(std::ranges::any_of(theirs, [&](const auto& w) {
          return w.normal == -wall.normal && w.offset == -wall.offset &&
                 std::ranges::count(w.neighbours, static_cast<int>(c)) == 1;
        }));
      }
    }
    sum += volume(solid);
  }
  EXPECT_NEAR(sum, box.volume(), 1e-12);
}

TEST(PrescoringCells, VoronoiCellsHoldWhatIsNearestToTheirSites) {
  const Box box(Vec3(0, 0, 0), Vec3(1, 1, 1));
  const std::vector<Vec3> sites{{0.2, 0.3, 0.1}, {0.8, 0.4, 0.3}, {0.5, 0.9, 0.6}, {0.1, 0.5, 0.9}, {9, 9, 9}};
  const auto cells = voronoi_cells(box, sites);
  ASSERT_TRUE(cells);
  EXPECT_TRUE((*cells)[4].box.isEmpty());
  for (int k = 0; k < 500; ++k) {
    const Vec3 p = 0.5 * (Vec3::Random() + Vec3::Ones());
    for (std::size_t c = 0; c < 4; ++c) {
      const bool inside =
          std::ranges::all_of((*cells)[c].walls, [&](const auto& w) { return w.normal.dot(p) <= w.offset; });
      const auto nearest = std::ranges::min_element(sites, {}, [&](const Vec3& s) { return (s - p).squaredNorm(); });
      EXPECT_EQ(inside, nearest - sites.begin() == static_cast<int>(c));
    }
  }
}

TEST(PrescoringCells, BadInputIsAnError) {
  const Box box(Vec3(0, 0, 0), Vec3(1, 1, 1));
  const auto text = [](const auto& r) { return r ? std::string("no error") : r.error().text(); };
  EXPECT_THAT(text(plane_cells(box, {})), HasSubstr("planes holds 0 planes"));
  EXPECT_THAT(text(plane_cells(box, {{Vec3::Zero(), 1}})), HasSubstr("planes[0] must be finite, with a normal"));
  EXPECT_THAT(text(voronoi_cells(box, {})), HasSubstr("sites holds 0 sites"));
  EXPECT_THAT(text(voronoi_cells(box, {Vec3(1, 2, 3), Vec3(1, 2, 3)})), HasSubstr("sites[1] is where sites[0] is"));
}

// ---- parts
// Areas, centroids and normals of a box that is quartered off its lattice, and along it.
TEST(PrescoredParts, FacesOfAQuarteredBoxAreRectangles) {
  const ExampleSet set = bar();
  for (const auto& [x, y] : {std::pair(0.13, 0.07), std::pair(0.0, 0.0), std::pair(0.25, 1e-13)}) {
    const auto cells = plane_cells(box_of(set.mesh), {{Vec3::UnitX(), x}, {Vec3::UnitY(), y}});
    ASSERT_TRUE(cells);
    const PrescoredAsset asset = broken(set, *cells);
    ASSERT_EQ(asset.parts.size(), 4u);
    ASSERT_EQ(asset.faces.size(), 4u);
    expect_consistent(set, asset);
    for (const PrescoredFace& face : asset.faces) {
      const Vec3 a = box_of(asset.parts[face.a].set.mesh).center(), b = box_of(asset.parts[face.b].set.mesh).center();
      const bool across_x = std::abs(face.normal.x()) > 0.5;
      const double height = a.y() < y ? 0.5 + y : 0.5 - y, width = a.x() < x ? 1 + x : 1 - x;
      EXPECT_NEAR(face.area, across_x ? height : width, 1e-9);
      EXPECT_LT(
          (face.normal - (across_x ? Vec3::UnitX() : Vec3::UnitY()) * (b - a).dot(face.normal) / (b - a).norm()).norm(),
          1e-9);
      EXPECT_GT(face.normal.dot(b - a), 0);
      const Vec3 middle = across_x ? Vec3(x, a.y(), 0) : Vec3(a.x(), y, 0);
      EXPECT_LT((face.centroid - middle).norm(), 1e-9);
    }
  }
}

// The area vectors of a part's faces and of its outer skin cancel: nothing is missing, nothing counted twice: on
// Voronoi cells, wood, and bricks, whose walls have several neighbours.
TEST(PrescoredParts, FacesCloseEveryPart) {
  const ExampleSet set = bar();
  const Box box = box_of(set.mesh);
  const std::vector<std::vector<SplinterCell>> ways{
      *stone_cells(box, 0.6, 5), *wood_cells(box, 0.35, 4, Vec3(2, 1, 0).normalized(), 3),
      *brick_cells(box, {0.6, 0.3, 0.45}),
      *voronoi_cells(box, {{-0.8, 0, 0}, {0.1, 0.3, 0.2}, {0.2, -0.4, -0.1}, {0.9, 0.1, 0}})};
  for (const auto& cells : ways) {
    const PrescoredAsset asset = broken(set, cells);
    ASSERT_GT(asset.parts.size(), 3u);
    expect_consistent(set, asset);
    std::vector<Vec3> sum(asset.parts.size(), Vec3::Zero());
    std::vector<double> walls(asset.parts.size(), 0.0);
    for (const PrescoredFace& face : asset.faces) {
      sum[face.a] += face.area * face.normal;  // bricks meet at right angles: normals of a pair are one
      sum[face.b] -= face.area * face.normal;
      walls[face.a] += face.area;
      walls[face.b] += face.area;
    }
    for (std::size_t p = 0; p < asset.parts.size(); ++p) {
      const TetMesh& mesh = asset.parts[p].set.mesh;
      double inside = 0;
      for (const auto& face : sim::surface_faces(mesh.tets)) {
        const Vec3 &a = mesh.X[face.nodes[0]], &b = mesh.X[face.nodes[1]], &c = mesh.X[face.nodes[2]];
        const Vec3 area = (b - a).cross(c - a) / 2, middle = (a + b + c) / 3;
        const bool outer = ((middle - box.min()).array() < 1e-7).any() || ((box.max() - middle).array() < 1e-7).any();
        if (outer) sum[p] += area;
        if (!outer) inside += area.norm();
      }
      EXPECT_LT(sum[p].norm(), 1e-6) << p;
      EXPECT_NEAR(walls[p], inside, 1e-6) << p;
    }
  }
}

TEST(PrescoredParts, OneCellThatHoldsTwoLegsMakesTwoParts) {
  const ExampleSet set = rigged(arch());
  const auto cells = plane_cells(box_of(set.mesh), {{Vec3::UnitY(), 0.8}});
  const PrescoredAsset asset = broken(set, *cells);
  ASSERT_EQ(asset.parts.size(), 3u);
  expect_consistent(set, asset);
  ASSERT_EQ(asset.faces.size(), 2u);
  for (const PrescoredFace& face : asset.faces) EXPECT_NEAR(face.area, 1, 1e-9);
  EXPECT_NEAR(asset.parts[0].volume, 0.8, 1e-9);
  EXPECT_EQ(asset.parts[0].cell, asset.parts[1].cell);
}

TEST(PrescoredParts, EveryVertexGoesWhereTheWholePutsIt) {
  const ExampleSet set = bar();
  const PrescoredAsset asset = broken(set, *stone_cells(box_of(set.mesh), 0.6, 9));
  std::size_t found = 0;
  for (const PrescoredPart& part : asset.parts)
    for (int v = 0; v < part.set.vertex_count(); ++v) {
      for (int i = 0; i < set.vertex_count(); ++i)
        if ((part.set.mesh.X[v] - set.mesh.X[i]).norm() < 1e-12) {
          ++found;
          for (int e = 0; e < 2; ++e) EXPECT_LT((posed(part.set, e, v) - posed(set, e, i)).norm(), 1e-7);
        }
      EXPECT_NEAR(part.set.alpha_scale[v], 2 + part.set.mesh.X[v].x(), 1e-6);  // linear in place
    }
  EXPECT_GE(found, set.mesh.X.size());
}

// Six times what triangles enclose is the sum of their determinants.
double volume_inside(const sim::SurfaceMesh& surface) {
  double six = 0;
  for (const Triangle& t : surface.triangles)
    six += surface.vertices[t[0]].dot(surface.vertices[t[1]].cross(surface.vertices[t[2]]));
  return six / 6;
}

TEST(PrescoredParts, WhatIsDrawnIsClosedAndHoldsThePart) {
  ExampleSet set = bar();
  const auto cells = *stone_cells(box_of(set.mesh), 0.7, 2);
  for (const PrescoredPart& part : broken(set, cells).parts)
    EXPECT_NEAR(volume_inside(part.set.render), part.volume, 1e-6);

  set.render.triangles.erase(set.render.triangles.begin());  // open: closed on the walls by the tets
  int whole = 0;
  const PrescoredAsset asset = broken(set, cells);
  for (const PrescoredPart& part : asset.parts) whole += std::abs(volume_inside(part.set.render) - part.volume) < 1e-6;
  EXPECT_GE(whole, static_cast<int>(asset.parts.size()) - 3);  // three corners have the hole at most
  EXPECT_LT(whole, static_cast<int>(asset.parts.size()));
}

TEST(PrescoredParts, HullsStayInTheirCells) {
  const ExampleSet set = bar();
  const auto cells = *stone_cells(box_of(set.mesh), 0.6, 4);
  for (const PrescoredPart& part : broken(set, cells).parts)
    for (const auto& hull : part.set.convex_parts)
      for (const int v : hull)
        for (const auto& wall : cells[part.cell].walls)
          EXPECT_LT(wall.normal.dot(part.set.mesh.X[v]) - wall.offset, 1e-7);
}

// Crumbs go to a neighbour, with volume, skin, bones and faces.
TEST(PrescoredParts, CrumbsJoinANeighbour) {
  const ExampleSet set = bar();
  const auto cells =
      *plane_cells(box_of(set.mesh), {{Vec3::UnitX(), 0.1}, {Vec3::UnitX(), 0.102}, {Vec3::UnitY(), 0.2}});
  const PrescoredAsset cut = broken(set, cells), joined = broken(set, cells, 0.01);
  ASSERT_EQ(cut.parts.size(), 6u);
  EXPECT_EQ(cut.faces.size(), 7u);
  const auto flat = *plane_cells(box_of(set.mesh), {{Vec3::UnitX(), 0.1}, {Vec3::UnitX(), 0.1001}});
  EXPECT_EQ(broken(set, flat).parts.size(), 2u);  // a tenth of a millimetre is no part, whatever is asked for
  ASSERT_EQ(joined.parts.size(), 4u);
  ASSERT_EQ(joined.faces.size(), 4u);
  double volume = 0, drawn = 0;
  for (const PrescoredPart& part : joined.parts) {
    volume += part.volume;
    drawn += volume_inside(part.set.render);
    EXPECT_GT(part.volume, 0.2);
    EXPECT_NEAR(part.volume, volume_of(part.set.mesh), 1e-12);
    std::vector<int> bones = part.bones;
    EXPECT_TRUE(std::ranges::is_sorted(bones) && std::ranges::adjacent_find(bones) == bones.end());
    for (int v = 0; v < part.set.vertex_count(); ++v) {
      for (int i = 0; i < set.vertex_count(); ++i)
        if ((part.set.mesh.X[v] - set.mesh.X[i]).norm() < 1e-12) {
          EXPECT_LT((posed(part.set, 1, v) - posed(set, 1, i)).norm(), 1e-7);
        }
      EXPECT_NEAR(part.set.alpha_scale[v], 2 + part.set.mesh.X[v].x(), 1e-6);
    }
  }
  EXPECT_NEAR(volume, 2, 1e-9);
  EXPECT_NEAR(drawn, 2, 1e-6);
  for (const PrescoredFace& face : joined.faces) {
    EXPECT_GT(face.area, 0.29);
    EXPECT_NEAR(std::max(std::abs(face.normal.x()), std::abs(face.normal.y())), 1, 1e-3);
  }
}

TEST(PrescoredParts, GeneratedAssetsBreak) {
  const auto barrel = make_barrel_asset();
  const auto car = make_car_asset();
  ASSERT_TRUE(barrel && car);
  for (const ExampleSet& set : {*barrel, *car}) {
    const Box box = box_of(set.mesh);
    const PrescoredAsset asset = broken(set, *stone_cells(box, 0.4 * box.sizes().maxCoeff(), 7));
    EXPECT_GT(asset.parts.size(), 4u);
    EXPECT_GE(asset.faces.size() + 1, asset.parts.size());
    expect_consistent(set, asset);
    const PrescoredAsset joined = broken(set, *stone_cells(box, 0.4 * box.sizes().maxCoeff(), 7), 0.05);
    EXPECT_LE(joined.parts.size(), asset.parts.size());
    double least = 1e300, sum = 0;
    for (const PrescoredPart& part : joined.parts) least = std::min(least, part.volume), sum += part.volume;
    EXPECT_GE(least, 0.05 * sum / static_cast<double>(asset.parts.size()));
  }
}

// Prints seconds.
TEST(PrescoredPartsSlow, ACarInManyPieces) {
  const auto car = make_car_asset();
  ASSERT_TRUE(car);
  const Box box = box_of(car->mesh);
  const auto cells = *stone_cells(box, 0.13 * box.sizes().maxCoeff(), 7);
  const auto start = std::chrono::steady_clock::now();
  const PrescoredAsset asset = broken(*car, cells);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::size_t tets = 0;
  for (const PrescoredPart& part : asset.parts) tets += part.set.mesh.tets.size();
  EXPECT_GT(asset.parts.size(), 50u);
  std::printf("%d tets in %zu cells: %zu parts, %zu tets, %zu faces, %.2f s\n", car->mesh.tet_count(), cells.size(),
              asset.parts.size(), tets, asset.faces.size(), seconds);
}

TEST(PrescoredParts, BadInputIsAnError) {
  const ExampleSet set = bar();
  const auto text = [](const auto& r) { return r ? std::string("no error") : r.error().text(); };
  EXPECT_THAT(text(prescored_parts(set, {})), HasSubstr("cells is empty"));
  EXPECT_THAT(text(prescored_parts(set, {}, {.least_part = 1})), HasSubstr("least_part is 1"));
  auto half = plane_cells(Box(Vec3(-1, -1, -1), Vec3(0.2, 1, 1)), {{Vec3::UnitX(), 0}});
  EXPECT_THAT(text(prescored_parts(set, {(*half)[0]})), HasSubstr("cells[0].walls name neighbour 1"));
  half->front().walls[0].neighbours.clear();
  EXPECT_THAT(text(prescored_parts(set, {(*half)[0]})), HasSubstr("cells hold 0.5 of the asset's volume"));
  ExampleSet wrong = set;
  wrong.W(0, 0) = 7;
  EXPECT_THAT(text(prescored_parts(wrong, *half)), HasSubstr("asset.W"));
}

}  // namespace
}  // namespace crumple::authoring
