#include "server/io/tet_import.h"

#include "tests/support/shared_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace crumple::io {
namespace {

using ::testing::HasSubstr;

std::string text(const Result<ImportedTets>& r) { return r ? std::string("no error") : r.error().text(); }

double volume(const sim::TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += sim::signed_volume(mesh, t);
  return sum;
}

// ---- shared files
// ----------------------------------------------------------------------------------------------------
TEST(TetImport, ReadsTheSharedVegaBeam) {
  CRUMPLE_NEED_SHARED("meshes");
  const auto tets = import_tets(test::shared_data("meshes/vega_beam3_tet.veg"));
  ASSERT_TRUE(tets) << tets.error().text();
  EXPECT_EQ(tets->mesh.node_count(), 208);  // as its header says
  EXPECT_EQ(tets->mesh.tet_count(), 450);
  EXPECT_EQ(tets->unused_nodes, 0);
}

TEST(TetImport, ReadsTheSharedTetGenCarFromEitherOfItsFiles) {
  CRUMPLE_NEED_SHARED("meshes");
  const auto tets = import_tets(test::shared_data("meshes/femfx_car-body-tets.node"));
  ASSERT_TRUE(tets) << tets.error().text();
  EXPECT_EQ(tets->mesh.node_count(), 318);
  EXPECT_EQ(tets->mesh.tet_count(), 898);
  const auto same = import_tets(test::shared_data("meshes/femfx_car-body-tets.ele"));
  ASSERT_TRUE(same);
  EXPECT_EQ(same->mesh.tets, tets->mesh.tets);
}

// ---- formats
// ---------------------------------------------------------------------------------------------------------- Two tets
// over the triangle (0,0,0) (1,0,0) (0,1,0), apices at z = 1 and z = -1; the second is written inside out.
const std::string kNodes0 = "5 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0  # a comment\n\n3 0 0 1\n4 0 0 -1\n";
const std::string kTets0 = "2 4 0\n0 0 1 2 3\n1 0 1 2 4\n";

TEST(TetImport, ReadsTetGenFromZeroAndFromOne) {
  const auto from0 = read_tetgen(kNodes0, kTets0, "a.node", "a.ele");
  ASSERT_TRUE(from0) << from0.error().text();
  EXPECT_EQ(from0->flipped, 1);
  EXPECT_NEAR(volume(from0->mesh), 2 / 6.0, 1e-15);
  const auto from1 = read_tetgen("5 3 1 1\n1 0 0 0 .5 1\n2 1 0 0 .5 1\n3 0 1 0 .5 1\n4 0 0 1 .5 1\n5 0 0 -1 .5 1\n",
                                 "2 4 1\n1 1 2 3 4 7\n2 1 2 3 5 7\n", "a.node", "a.ele");
  ASSERT_TRUE(from1) << from1.error().text();
  EXPECT_EQ(from1->mesh.tets, from0->mesh.tets);
  EXPECT_EQ(from1->mesh.X, from0->mesh.X);
}

const std::string kMsh2 = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
3 1 "rock and roll"
$EndPhysicalNames
$Nodes
6
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 0 0 -1
60 9 9 9
$EndNodes
$Elements
4
1 15 2 0 1 60
2 2 2 0 1 10 20 30
3 4 2 1 1 10 20 30 40
4 4 3 1 1 0 10 20 30 50
$EndElements
)";

const std::string kMsh41 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
1 0 0 1
1 0 0 0 0
1 0 0 -1 1 1 1 0 0
$EndEntities
$Nodes
2 6 10 60
0 1 0 1
60
9 9 9
3 1 1 5
10
20
30
40
50
0 0 0 0.1 0.2 0.3
1 0 0 0.1 0.2 0.3
0 1 0 0.1 0.2 0.3
0 0 1 0.1 0.2 0.3
0 0 -1 0.1 0.2 0.3
$EndNodes
$Elements
2 3 1 4
0 1 15 1
1 60
3 1 4 2
3 10 20 30 40
4 10 20 30 50
$EndElements
)";

TEST(TetImport, ReadsBothGmshFormatsAlike) {
  const auto v2 = read_gmsh(kMsh2, "a.msh"), v4 = read_gmsh(kMsh41, "b.msh");
  ASSERT_TRUE(v2) << v2.error().text();
  ASSERT_TRUE(v4) << v4.error().text();
  for (const auto& r : {*v2, *v4}) {
    EXPECT_EQ(r.mesh.node_count(), 5);
    EXPECT_EQ(r.mesh.tet_count(), 2);
    EXPECT_EQ(r.unused_nodes, 1);
    EXPECT_EQ(r.flipped, 1);
    EXPECT_NEAR(volume(r.mesh), 2 / 6.0, 1e-15);
  }
  EXPECT_EQ(v2->other_elements, 2);
  EXPECT_EQ(v4->other_elements, 1);
  EXPECT_EQ(v2->mesh.tets, v4->mesh.tets);
  EXPECT_EQ(v2->mesh.X, v4->mesh.X);
}

const std::string kVega =
    "# beam\n*VERTICES\n5 3 0 0\n1 0 0 0\n2 1, 0, 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n"
    "*ELEMENTS\nTETS\n2 4 0\n1 1 2 3 4\n2 1 2 3 5\n*MATERIAL m\nENU, 1, 2, .3\n*REGION\nall, m\n";

TEST(TetImport, ReadsVega) {
  const auto tets = read_vega(kVega, "a.veg");
  ASSERT_TRUE(tets) << tets.error().text();
  EXPECT_EQ(tets->mesh.tet_count(), 2);
  EXPECT_NEAR(volume(tets->mesh), 2 / 6.0, 1e-15);
}

// ---- parts
// ----------------------------------------------------------------------------------------------------------
std::string replaced(std::string in, const std::string& what, const std::string& with) {
  return in.replace(in.find(what), what.size(), with);
}

std::vector<int> tags(const Result<ImportedTets>& r) { return r ? r->mesh.tags : std::vector<int>{-999}; }

TEST(TetImport, TetGenAttributesAreTags) {
  using testing::ElementsAre;
  using testing::IsEmpty;
  const auto read = [](const std::string& ele) { return tags(read_tetgen(kNodes0, ele, "a.node", "a.ele")); };
  EXPECT_THAT(read(kTets0), IsEmpty());
  EXPECT_THAT(read("2 4 1\n0 0 1 2 3 7\n1 0 1 2 4 -3  # c\n"), ElementsAre(7, -3));
  EXPECT_THAT(read("2 4 2\n0 0 1 2 3 2.0 9\n1 0 1 2 4 +1e1 9\n"), ElementsAre(2, 10));
  EXPECT_THAT(read("2 4 1\n0 0 1 2 3 7\n1 0 1 2 4 0.5\n"), IsEmpty());  // no numbers of parts
  EXPECT_THAT(read("2 4 1\n0 0 1 2 3 7\n1 0 1 2 4\n"), IsEmpty());
  EXPECT_THAT(read("2 4 1\n0 0 1 2 3 0\n1 0 1 2 4 0\n"), IsEmpty());
  // Ten-node tets: the attribute stands behind the ten.
  EXPECT_THAT(read("2 10 1\n0 0 1 2 3 4 4 4 4 4 4 5\n1 0 1 2 4 3 3 3 3 3 3 6\n"), ElementsAre(5, 6));
}

TEST(TetImport, GmshPhysicalGroupsAreTags) {
  using testing::ElementsAre;
  using testing::IsEmpty;
  EXPECT_THAT(tags(read_gmsh(kMsh2, "a.msh")), ElementsAre(1, 1));
  EXPECT_THAT(tags(read_gmsh(replaced(kMsh2, "4 4 3 1 1 0", "4 4 3 8 1 0"), "a.msh")), ElementsAre(1, 8));
  EXPECT_THAT(tags(read_gmsh(kMsh41, "b.msh")), IsEmpty());  // its volume is in no group
  const std::string grouped = replaced(kMsh41, "1 0 0 -1 1 1 1 0 0", "1 0 0 -1 1 1 1 2 6 4 0");
  EXPECT_THAT(tags(read_gmsh(grouped, "b.msh")), ElementsAre(6, 6));
}

TEST(TetImport, VegaRegionsAreTags) {
  using testing::ElementsAre;
  using testing::IsEmpty;
  EXPECT_THAT(tags(read_vega(kVega, "a.veg")), IsEmpty());  // a region of a set that is not there
  const std::string two = replaced(kVega, "all, m", "allElements, m\n*SET frame\n2,\n*REGION\nframe, steel");
  EXPECT_THAT(tags(read_vega(two, "a.veg")), ElementsAre(1, 2));
  EXPECT_THAT(text(read_vega(replaced(two, "frame\n2", "frame\n3"), "a.veg")),
              HasSubstr("a.veg, set frame names element 3, must be in [1, 2]"));
  EXPECT_THAT(text(read_vega(replaced(two, "frame\n2", "frame\nx"), "a.veg")), HasSubstr("'x' stands in a set"));
}

// ---- bad input
// ----------------------------------------------------------------------------------------------------------
TEST(TetImport, ErrorsNameFileLineAndValue) {
  EXPECT_EQ(text(read_tetgen(replaced(kNodes0, "1 1 0 0", "1 1 x 0"), kTets0, "a.node", "a.ele")),
            "a.node:3 y is 'x', must be a finite number");
  EXPECT_EQ(text(read_tetgen(kNodes0, replaced(kTets0, "1 2 4", "1 2 5"), "a.node", "a.ele")),
            "a.ele:3 node id is 5, must be in [0, 4]");
  EXPECT_EQ(text(read_tetgen(replaced(kNodes0, "3 0 0 1", "7 0 0 1"), kTets0, "a.node", "a.ele")),
            "a.node:6 node id is 7, must be in [3, 3]");
  EXPECT_THAT(text(read_tetgen(kNodes0, "3 4 0\n0 0 1 2 3\n", "a.node", "a.ele")), HasSubstr("ends too early"));
  EXPECT_THAT(text(read_tetgen(kNodes0, "1 4 0\n0 0 1 2 2\n", "a.node", "a.ele")),
              HasSubstr("a.ele.tets[0] names node 2 twice"));
  EXPECT_THAT(text(read_tetgen("9000000000 3 0 0\n", kTets0, "a.node", "a.ele")),
              HasSubstr("number of nodes is 9000000000"));
  EXPECT_THAT(text(read_tetgen(kNodes0, replaced(kTets0, "2 4 0", "10000000 4 0"), "a.node", "a.ele")),
              HasSubstr("a.ele:1 number of tets is 10000000, must be in [1, 2000000]"));
  EXPECT_THAT(text(read_tetgen(replaced(kNodes0, "1 1 0 0", "1 1e999 0 0"), kTets0, "a.node", "a.ele")),
              HasSubstr("'1e999'"));

  EXPECT_EQ(text(read_gmsh(replaced(kMsh2, "2.2 0 8", "2.2 1 8"), "a.msh")), "a.msh:2 is a binary file, must be ASCII");
  EXPECT_EQ(text(read_gmsh(replaced(kMsh2, "2.2 0 8", "4 0 8"), "a.msh")),
            "a.msh:2 has format 4, must have 2.x or 4.1");
  EXPECT_EQ(text(read_gmsh(replaced(kMsh2, "20 1 0 0", "10 1 0 0"), "a.msh")), "a.msh:11 node 10 is there twice");
  EXPECT_EQ(text(read_gmsh(replaced(kMsh2, "30 50", "30 51"), "a.msh")),
            "a.msh, tet 2 names node 51, which is not there");
  EXPECT_THAT(text(read_gmsh(replaced(kMsh2, "3 4 2", "3 11 2"), "a.msh")),
              HasSubstr("a.msh:21 is a tet of ten nodes"));
  EXPECT_THAT(text(read_gmsh(replaced(kMsh41, "3 1 4 2", "3 1 4 9"), "b.msh")), HasSubstr("b.msh:"));
  EXPECT_THAT(text(read_gmsh("hello", "a.msh")), HasSubstr("a.msh:1 must begin with $MeshFormat"));

  EXPECT_THAT(text(read_vega(replaced(kVega, "TETS", "CUBIC"), "a.veg")), HasSubstr("a.veg:10 elements are 'CUBIC'"));
  EXPECT_THAT(text(read_vega("*INCLUDE other.veg\n", "a.veg")), HasSubstr("a.veg:1 includes another file"));
  EXPECT_THAT(text(read_vega("*ELEMENTS\nTETS\n", "a.veg")), HasSubstr("*ELEMENTS before *VERTICES"));

  EXPECT_THAT(text(import_tets("nowhere/a.veg")), HasSubstr("a.veg"));
  EXPECT_THAT(text(import_tets("a.stl")), HasSubstr("a.stl is not a tet mesh file"));
}

// Every prefix and thousands of single-byte changes of the samples: an error or a valid mesh, and no crash.
TEST(TetImport, SurvivesTruncationAndNoise) {
  const auto check = [](const Result<ImportedTets>& r) {
    if (r) {
      EXPECT_TRUE(sim::validate(r->mesh, "mesh"));
    }
  };
  const auto read_all = [&](const std::string& s) {
    check(read_gmsh(s, "a.msh"));
    check(read_vega(s, "a.veg"));
    check(read_tetgen(s, kTets0, "a.node", "a.ele"));
    check(read_tetgen(kNodes0, s, "a.node", "a.ele"));
  };
  std::mt19937 random(11);
  const std::string parts = replaced(kVega, "all, m", "allElements, m\n*SET frame\n2,\n*REGION\nframe, steel");
  const std::string attributes = "2 4 1\n0 0 1 2 3 7\n1 0 1 2 4 -3\n";
  for (const std::string& whole : {kMsh2, kMsh41, kVega, parts, kNodes0, kTets0, attributes}) {
    for (size_t n = 0; n < whole.size(); ++n) read_all(whole.substr(0, n));
    for (int k = 0; k < 2000; ++k) {
      std::string changed = whole;
      changed[random() % changed.size()] =
          static_cast<char>(k % 2 ? random() % 256 : "0123456789-. e\n"[random() % 15]);
      read_all(changed);
    }
  }
}

}  // namespace
}  // namespace crumple::io
