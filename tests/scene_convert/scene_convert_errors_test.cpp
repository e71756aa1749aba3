#include "server/scene_convert/recording_convert.h"
#include "server/scene_convert/scene_convert.h"

#include "tests/scene_convert/parse_scene.h"

#include <gtest/gtest.h>

namespace crumple::scene_convert {
namespace {

struct Bad {
  const char* what;
  const char* text;  // of a scene, in protobuf's text format
  const char* field;
  const char* rule;  // part of the message
};
void PrintTo(const Bad& b, std::ostream* out) { *out << b.what; }

class BadScene : public testing::TestWithParam<Bad> {};

TEST_P(BadScene, GivesOneErrorWithItsFieldPath) {
  const auto scene = to_scene(test::parse<v1::Scene>(GetParam().text), NoFiles());
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(scene.error().field, GetParam().field) << scene.error().text();
  EXPECT_NE(scene.error().message.find(GetParam().rule), std::string::npos) << scene.error().text();
}

#define BALL "bodies { name: 'ball' rigid { shapes { sphere {} } } } "
#define TET "positions: [0,0,0, 1,0,0, 0,1,0, 0,0,1] "
#define FEM(mesh, rest) "bodies { name: 'b' fem { mesh { " mesh " } " rest " } }"
#define ASSET(weights, rest)                                                                               \
  "bodies { name: 'b' example { asset { inline_asset { mesh { " TET "tets: [0,1,2,3] } weights { " weights \
  " } examples { bones {} } convex_parts { vertices: [0,1,2,3] } " rest " } } } }"

const Bad kBad[] = {
    {"dt_nan", "dt: nan", "dt", "must be a number"},
    {"dt_negative", "dt: -1", "dt", "is -1, must be at least 1e-06"},
    {"gravity_inf", "gravity { y: -inf }", "gravity.y", "is -inf, must be finite"},
    {"no_model", "bodies { name: 'b' }", "bodies[0]", "one of rigid, fem, example"},
    {"no_shape", "bodies { name: 'b' rigid { shapes {} } }", "bodies[0].rigid.shapes[0]", "has no shape"},
    {"kind", "bodies { name: 'b' rigid { kind: 7 shapes { box {} } } }", "bodies[0].rigid.kind", "is 7"},
    {"position_nan", "bodies { name: 'b' pose { position { y: nan } } rigid { shapes { box {} } } }",
     "bodies[0].pose.position.y", "nan"},
    {"zero_quaternion", "bodies { name: 'b' pose { quaternion {} } rigid { shapes { box {} } } }",
     "bodies[0].pose.quaternion", "has length 0"},
    {"rotation_vector", "bodies { name: 'b' pose { rotation_vector { x: inf } } rigid { shapes { box {} } } }",
     "bodies[0].pose.rotation_vector.x", "finite"},
    {"same_name", BALL BALL, "bodies[1].name", "is \"ball\""},
    {"poisson", BALL FEM("box {}", "material { poisson_ratio: 0.5 }"), "bodies[1].fem.material.poisson_ratio",
     "is 0.5, must be below 0.5"},
    {"young", FEM("box {}", "material { young: nan }"), "bodies[0].fem.material.young", "nan"},
    {"toughness", FEM("box {}", "material { toughness: -3 }"), "bodies[0].fem.material.toughness", "above 0"},
    {"solver", "solver: 9", "solver", "is 9"},
    {"integrator", "integrator: 5", "integrator", "is 5"},
    {"rotation_rule", FEM("box {}", "material { rotation: 5 }"), "bodies[0].fem.material.rotation", "is 5"},
    {"flow_rule", FEM("box {}", "material { flow: 5 }"), "bodies[0].fem.material.flow",
     "is 5, must be ADDITIVE or DEVIATORIC"},

    {"dust", FEM("box {}", "material { dust: -1 }"), "bodies[0].fem.material.dust", "is -1, must be at least 0"},
    {"splinters_of_nothing", FEM("box {}", "splinters {}"), "bodies[0].fem.splinters",
     "must be one of given, stone, glass, wood, brick"},
    {"splinters_given", FEM("box {}", "splinters { given {} }"), "bodies[0].fem.splinters.given", "needs render"},
    {"splinter_size", FEM("box {}", "splinters { stone { size: 0 } }"), "bodies[0].fem.splinters.stone.size",
     "is 0, must be at least 1e-04"},
    {"splinter_count", FEM("box {}", "splinters { glass { size: 0.001 } }"), "bodies[0].fem.splinters.glass.size",
     "makes about 2e+06 splinters, must make at most 100000"},
    {"splinter_aspect", FEM("box {}", "splinters { wood { aspect: 0.5 } }"), "bodies[0].fem.splinters.wood.aspect",
     "is 0.5, must be at least 1"},
    {"splinter_grain", FEM("box {}", "splinters { wood { grain {} } }"), "bodies[0].fem.splinters.wood.grain", "is zero"},
    {"splinter_grain_nan", FEM("box {}", "splinters { wood { grain { z: nan } } }"), "bodies[0].fem.splinters.wood.grain.z",
     "nan"},
    {"splinter_block", FEM("box {}", "splinters { brick { size { x: 1 y: 1 z: -1 } } }"),
     "bodies[0].fem.splinters.brick.size.z", "is -1"},
    {"splinters_of_an_open_surface",
     FEM("box {}", "splinters { stone {} } render { inline_mesh { vertices: [0,0,0, 1,0,0, 0,1,0] triangles: [0,1,2] } }"),
     "bodies[0].fem.render", "has 3 edges at which its triangles do not meet in pairs"},

    {"region_without_tets", FEM("box {}", "regions {}"), "bodies[0].fem.regions[0].tets", "selects no tet"},
    {"region_rule", FEM("box {}", "regions { tets {} }"), "bodies[0].fem.regions[0].tets[0]",
     "one of box, sphere, plane, ids, tag"},
    {"region_far_away", FEM("box {}", "regions { tets { sphere { centre { x: 9 } } } }"),
     "bodies[0].fem.regions[0].tets", "selects no tet"},
    {"region_covered", FEM("box {}", "regions { tets { sphere { radius: 0.6 } } } regions { tets { sphere { radius: 2 } } }"),
     "bodies[0].fem.regions[0].tets", "no later region"},
    {"region_box", FEM("box {}", "regions { tets { box { min { x: 1 } max { x: -1 } } } }"),
     "bodies[0].fem.regions[0].tets[0].box", "inside out"},
    {"region_box_nan", FEM("box {}", "regions { tets { box { min { x: nan } } } }"),
     "bodies[0].fem.regions[0].tets[0].box.min.x", "nan"},
    {"region_sphere", FEM("box {}", "regions { tets { sphere { radius: -1 } } }"),
     "bodies[0].fem.regions[0].tets[0].sphere.radius", "is -1, must be at least 0"},
    {"region_plane", FEM("box {}", "regions { tets { plane { normal { x: 2 } } } }"),
     "bodies[0].fem.regions[0].tets[0].plane.normal", "unit length"},
    {"region_id", FEM("box {}", "regions { tets { ids { ids: [3, 48] } } }"),
     "bodies[0].fem.regions[0].tets[0].ids.ids[1]", "is 48, must be a tet of the mesh, below 48"},
    {"region_id_negative", FEM("box {}", "regions { tets { ids { ids: [-1] } } }"),
     "bodies[0].fem.regions[0].tets[0].ids.ids[0]", "is -1"},
    {"region_no_tags", FEM("box {}", "regions { tets { tag: 3 } }"), "bodies[0].fem.regions[0].tets[0].tag",
     "has no tags"},
    {"region_tag", FEM("inline_mesh { " TET " tets: [0,1,2,3] tags: 2 }", "regions { tets { tag: 3 } }"),
     "bodies[0].fem.regions[0].tets", "selects no tet"},
    {"region_material", FEM("box {}", "regions { tets { plane { offset: 9 } } material { young: -1 } }"),
     "bodies[0].fem.regions[0].material.young", "is -1, must be above 0"},
    {"region_poisson", FEM("box {}", "regions { tets { plane { offset: 9 } } material { poisson_ratio: 0.5 } }"),
     "bodies[0].fem.regions[0].material.poisson_ratio", "below 0.5"},
    {"region_friction", FEM("box {}", "regions { tets { plane { offset: 9 } } material { friction: 0.4 } }"),
     "bodies[0].fem.regions[0].material.friction", "goes for the whole body"},
    {"region_cg", FEM("box {}", "regions { tets { plane { offset: 9 } } material { cg_tolerance: 1e-3 } }"),
     "bodies[0].fem.regions[0].material.cg_tolerance", "goes for the whole body"},
    {"tags", FEM("inline_mesh { " TET " tets: [0,1,2,3] tags: [1, 2] }", ""), "bodies[0].fem.mesh.inline_mesh.tags",
     "holds 2 values, must hold none or one a tet (1)"},

    {"no_source", FEM("", ""), "bodies[0].fem.mesh", "has no source"},
    {"empty_mesh", FEM("inline_mesh {}", ""), "bodies[0].fem.mesh.inline_mesh.tets", "empty"},
    {"inverted_tet", FEM("inline_mesh { " TET " tets: [0,2,1,3] }", ""), "bodies[0].fem.mesh.inline_mesh.tets[0]",
     "volume -0.16"},
    {"zero_tet", FEM("inline_mesh { " TET " positions: [1,1,0] tets: [0,1,2,3, 0,1,2,4] }", ""),
     "bodies[0].fem.mesh.inline_mesh.tets[1]", "volume 0"},
    {"tet_ids", FEM("inline_mesh { " TET " tets: [0,1,2,9] }", ""), "bodies[0].fem.mesh.inline_mesh.tets[0]", "9"},
    {"negative_id", FEM("inline_mesh { " TET " tets: [0,1,2,-3] }", ""), "bodies[0].fem.mesh.inline_mesh.tets[0]",
     "-3"},
    {"position_of_node", FEM("inline_mesh { positions: [0,0,nan, 1,0,0, 0,1,0, 0,0,1] tets: [0,1,2,3] }", ""),
     "bodies[0].fem.mesh.inline_mesh.positions[0]", "finite"},
    {"cut_positions", FEM("inline_mesh { positions: [0,0] tets: [0,1,2,3] }", ""),
     "bodies[0].fem.mesh.inline_mesh.positions", "has 2 numbers, must have 3 a node"},
    {"cut_tets", FEM("inline_mesh { " TET " tets: [0,1,2] }", ""), "bodies[0].fem.mesh.inline_mesh.tets", "4 a tet"},
    {"fill", FEM("inline_mesh { " TET " tets: [0,1,2,3] fill: 1.5 }", ""), "bodies[0].fem.mesh.inline_mesh.fill[0]",
     "is 1.5"},
    {"ten_million_cells", FEM("box { cells { x: 1000 y: 1000 z: 10 } }", ""), "bodies[0].fem.mesh.box.cells",
     "2000000"},
    {"cells", FEM("pane { cells { x: 0 y: 1 z: 1 } }", ""), "bodies[0].fem.mesh.pane.cells.x", "at least 1"},
    {"lattice", FEM("pane { cells { x: 1 y: 1 z: 1 lattice: 8 } }", ""), "bodies[0].fem.mesh.pane.cells.lattice",
     "is 8"},
    {"size", FEM("box { size { x: 1 y: inf z: 1 } }", ""), "bodies[0].fem.mesh.box.size.y", "finite"},
    {"length", FEM("beam { length: -1 }", ""), "bodies[0].fem.mesh.beam.length", "at least"},
    {"scale", FEM("box {} scale: 0", ""), "bodies[0].fem.mesh.scale", "at least"},
    {"cell_size", FEM("enclosing { surface { sphere {} } cell_size: nan }", ""),
     "bodies[0].fem.mesh.enclosing.cell_size", "number"},
    {"ten_million_tets", FEM("enclosing { surface { sphere {} } cell_size: 0.001 }", ""),
     "bodies[0].fem.mesh.enclosing.cell_size", "is 0.001"},
    {"empty_surface", FEM("enclosing { surface { inline_mesh {} } }", ""),
     "bodies[0].fem.mesh.enclosing.surface.inline_mesh.vertices", "empty"},
    {"file_in_a_call", FEM("file: 'a.msh'", ""), "bodies[0].fem.mesh.file", "a call brings no files"},
    {"surface_file_in_a_call", FEM("enclosing { surface { file: 'a.obj' } }", ""),
     "bodies[0].fem.mesh.enclosing.surface.file", "is \"a.obj\""},

    {"face", FEM("box {}", "motions { nodes { face: 'left' } }"), "bodies[0].fem.motions[0].nodes[0].face",
     "is \"left\", must be one of x_min"},
    {"no_node", FEM("box {}", "motions { nodes { box { min { x: 5 } max { x: 6 } } } }"),
     "bodies[0].fem.motions[0].nodes", "selects no node"},
    {"box_inside_out", FEM("box {}", "motions { nodes { box { min { x: 5 } max { x: 4 } } } }"),
     "bodies[0].fem.motions[0].nodes[0].box", "inside out"},
    {"node_id", FEM("box {}", "motions { nodes { ids { ids: [0, 27] } } }"),
     "bodies[0].fem.motions[0].nodes[0].ids.ids[1]", "is 27"},
    {"no_rule", FEM("box {}", "motions { nodes {} }"), "bodies[0].fem.motions[0].nodes[0]", "one of box, face, ids"},
    {"node_twice", FEM("box {}", "motions { nodes { face: 'x_min' } } motions { nodes { face: 'y_min' } }"),
     "bodies[0].fem.motions[1].nodes", "again"},
    {"key_order", FEM("box {}", "motions { nodes { face: 'x_min' } keys { time: 1 } keys { time: 0.5 } }"),
     "bodies[0].fem.motions[0].keys[1].time", "above the key before it"},

    {"weights_do_not_sum", ASSET("bones: 1 dense { values: [1,1,0.9,1] }", ""),
     "bodies[0].example.asset.inline_asset.weights[2]", "sums to 0.9, must sum to 1"},
    {"weights_size", ASSET("bones: 1 dense { values: [1,1,1] }", ""),
     "bodies[0].example.asset.inline_asset.weights.dense.values", "has 3 numbers, must have 4"},
    {"weights_sparse", ASSET("bones: 1 sparse { row_start: [0,1,2,3,9] bone: [0,0,0,0] weight: [1,1,1,1] }", ""),
     "bodies[0].example.asset.inline_asset.weights.sparse.row_start[4]", "is 9"},
    {"weights_bone", ASSET("bones: 1 sparse { row_start: [0,1,2,3,4] bone: [0,0,1,0] weight: [1,1,1,1] }", ""),
     "bodies[0].example.asset.inline_asset.weights.sparse.bone[2]", "is 1"},
    {"weights_none", ASSET("bones: 1", ""), "bodies[0].example.asset.inline_asset.weights", "dense or sparse"},
    {"weights_bones", ASSET("bones: 2000000000", ""), "bodies[0].example.asset.inline_asset.weights.bones", "at most"},
    {"pose_bones", ASSET("bones: 1 dense { values: [1,1,1,1] }", "examples { name: 'dent' }"),
     "bodies[0].example.asset.inline_asset.examples[1].bones", "0 transforms"},
    {"pose_nan", ASSET("bones: 1 dense { values: [1,1,1,1] }", "examples { bones { translation { x: nan } } }"),
     "bodies[0].example.asset.inline_asset.examples[1].bones[0].translation.x", "finite"},
    {"part", ASSET("bones: 1 dense { values: [1,1,1,1] }", "convex_parts { vertices: [0,1,2,4] }"),
     "bodies[0].example.asset.inline_asset.convex_parts[1].vertices[3]", "is 4"},
    {"step", "bodies { name: 'b' example { parameters { step: 4 } asset { barrel {} } } }",
     "bodies[0].example.parameters.step", "EQUATION_8"},
    {"goal", "bodies { name: 'b' example { parameters { secondary_goal: 3 } asset { barrel {} } } }",
     "bodies[0].example.parameters.secondary_goal", "FEW_EXAMPLES"},
    {"barrel", "bodies { name: 'b' example { asset { barrel { shape { radius: -1 } } } } }",
     "bodies[0].example.asset.barrel.shape.radius", "at least"},
    {"bones", "bodies { name: 'b' example { asset { default_rig { bones: 1000 surface { box {} } } } } }",
     "bodies[0].example.asset.default_rig.bones", "at most 256"},
    {"rig_weights", "bodies { name: 'b' example { asset { default_rig { weights: 7 surface { box {} } } } } }",
     "bodies[0].example.asset.default_rig.weights", "GAUSSIAN or BOUNDED_BIHARMONIC"},
    {"car", "bodies { name: 'b' example { asset { car { cell_size: -1 } } } }", "bodies[0].example.asset.car.cell_size",
     "at least 1e-04"},

    {"mixed_shapes", "bodies { name: 'b' rigid { shapes { box {} } shapes { triangles { mesh { box {} } } } } }",
     "bodies[0].rigid.shapes[1]", "mixes triangles"},
    {"hull_twice", "bodies { name: 'b' rigid { shapes { convex_hull { points {} surface { box {} } } } } }",
     "bodies[0].rigid.shapes[0].convex_hull.surface", "alone"},
    {"moving_plane", "bodies { name: 'b' rigid { shapes { plane {} } } }", "bodies[0].rigid.shapes[0].plane", "FIXED"},

    {"unknown_body", BALL "script { command { apply_force { body: 'bat' } } }", "script[0].command.apply_force.body",
     "is \"bat\""},
    {"no_command", BALL "script {}", "script[0].command", "one of apply_impulse"},
    {"force_nan", BALL "script { command { apply_force { body: 'ball' force { x: nan } } } }",
     "script[0].command.apply_force.force.x", "finite"},
    {"impulse_huge", BALL "script { command { apply_impulse { body: 'ball' impulse { x: 1e10 } } } }",
     "script[0].command.apply_impulse.impulse", "at most 1e+09"},
    {"time_nan", BALL "script { time: nan command { apply_impulse { body: 'ball' } } }", "script[0].time", "number"},
    {"script_nodes", FEM("box {}", "") "script { command { apply_node_impulse { body: 'b' nodes: 99 } } }",
     "script[0].command.apply_node_impulse.nodes[0]", "is 99"},
    {"every", "recording { every: 0 }", "recording.every", "at least 1"},
    {"format", "recording { formats: CSV formats: 9 }", "recording.formats[1]", "is 9"},
};

INSTANTIATE_TEST_SUITE_P(SceneConvert, BadScene, testing::ValuesIn(kBad),
                         [](const auto& info) { return std::string(info.param.what); });

TEST(SceneConvert, NamesTheFirstBreachOfSeveral) {
  const auto scene =
      to_scene(test::parse<v1::Scene>(FEM("box {}", "material { young: -1 poisson_ratio: 2 density: -5 }")), NoFiles());
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().field, "bodies[0].fem.material.young");
}

// 10,000 bodies of a million tets would take hours and all memory; the second is already too many.
TEST(SceneConvert, StopsMakingBodiesOnceTheSceneIsTooLarge) {
  v1::Scene message;
  for (int i = 0; i < 10'000; ++i) {
    v1::Body* body = message.add_bodies();
    body->set_name(std::to_string(i));
    v1::BoxTets* box = body->mutable_fem()->mutable_mesh()->mutable_box();
    *box->mutable_size() = test::parse<v1::Vec3>("x: 1 y: 1 z: " + std::to_string(1 + i % 9000));
    *box->mutable_cells() = test::parse<v1::Cells>("x: 2 y: 300 z: 300");
  }
  const auto scene = to_scene(message, NoFiles());
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().field, "bodies[1]") << scene.error().text();
  EXPECT_NE(scene.error().message.find("must be at most 2000000 in all"), std::string::npos) << scene.error().text();
}

TEST(Recording, MissingFormatsAreFramesAndCsv) {
  const auto missing = to_recording({});
  ASSERT_TRUE(missing);
  EXPECT_EQ(missing->every, 1);
  EXPECT_TRUE(missing->frames && missing->csv && !missing->vtu && !missing->ply);
  const auto given = to_recording(test::parse<v1::Recording>("every: 5 formats: [VTU, PLY]"));
  ASSERT_TRUE(given);
  EXPECT_EQ(given->every, 5);
  EXPECT_TRUE(!given->frames && !given->csv && given->vtu && given->ply);
}

}  // namespace
}  // namespace crumple::scene_convert
