#include "common/text.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/pinning.h"

namespace crumple::lab::chart {
namespace {

using authoring::Lattice;
using sim::Integrator;
using sim::fem::RotationRule;
using sim::linear_solver::SolverKind;

constexpr auto kOctahedra = sim::fem::ElementKind::smoothed_octahedra;
constexpr auto kHexahedra = sim::fem::ElementKind::hexahedra;
constexpr const char* kBeamB = "Beam B: 1 x 0.16 x 0.16 m, E = 1 MPa, nu = 0.3, 1000 kg/m3, held at one end, dropped under gravity for one second";
constexpr const char* kTwoLevels = "two levels are stored";
const PanelAxis kIterations{"iterations", "CG iterations a step"};
const PanelAxis kDt{"value", "dt [s]"};
const PanelAxis kCellSize{"value", "1 / cells across"};

Study solver() {
  Study s{.name = "solver", .title = "Solver error: what an iteration buys"};
  s.scene = text(kBeamB, "; 2,400 tets, dt = 1/60 s.");
  s.reference = "The same steps with every system solved by a direct factorisation in double, on the same mesh and dt. Mass-weighted L2 of "
                "the displacement over nodes and sampled times.";
  s.measure = beam_against_direct_solves();
  s.more = {kIterations};
  s.curves = {{"block-Jacobi, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::jacobi}},
              {"multigrid, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::multigrid}},
              {"multigrid, float matrix, tolerance", knobs::cg_tolerance(), {.float_solver = true, .solver = SolverKind::multigrid}},
              {"multigrid, polar + QR, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::multigrid, .rotation = RotationRule::polar_qr}},
              {"block-Jacobi, cap, no guard", knobs::cg_cap(), {.solver = SolverKind::jacobi}},
              {"block-Jacobi, cap, guarded", knobs::cg_cap(true), {.solver = SolverKind::jacobi}},
              {"direct", {"-", {{1, "direct"}}, [](Setup&, double) {}}, {.solver = SolverKind::direct}, 0, "a direct solve has nothing to set"},
              {"warped factor, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::warped_factor}}};
  for (const std::size_t c : {std::size_t{3}, std::size_t{5}}) {
    for (KnobValue& v : s.curves[c].knob.values) v.heavy = true;
  }
  return s;
}

Study time(const Workshop& w) {
  Study s{.name = "time", .title = "Time error: what a step buys"};
  s.scene = "S12's swing: a beam of 1 x 0.1 x 0.1 m, 240 tets, E = 1 MPa, under gravity from rest, undamped, one second.";
  s.reference = w.has("S12_dynamics_step_load")
                    ? "An independent velocity-Verlet run on the same mesh at dt = 1/24000 s, known to 3e-6. Tip, relative L2 over the samples."
                    : "Reference not at hand: compared with this code's own limit of small steps (direct solves, extrapolated in first order).";
  s.measure = swing();
  s.more = {kDt, kIterations};
  s.curves = {{"backward Euler, solved to 1e-8", knobs::dt(), {.cg_tolerance = 1e-8}, 1},
              {"backward Euler, solved to 1e-3", knobs::dt(), {}, 1},
              {"backward Euler, float matrix, 1e-8", knobs::dt(), {.cg_tolerance = 1e-8, .float_solver = true}, 1},
              {"backward Euler, polar + QR, 1e-8", knobs::dt(), {.cg_tolerance = 1e-8, .rotation = RotationRule::polar_qr}, 1},
              {"BDF2, solved to 1e-8", knobs::dt(), {.cg_tolerance = 1e-8, .integrator = Integrator::bdf2}, 2},
              {"BDF2, solved to 1e-3", knobs::dt(), {.integrator = Integrator::bdf2}, 0}};
  return s;
}

Study lattices(const Workshop& w) {
  Study s{.name = "mesh", .title = "Mesh error: what an element buys"};
  s.scene = "S03's cantilever, 1 x 0.1 x 0.1 m, E = 10 MPa, pulled down at its end by 0.25 N; linear elasticity, direct solve; n x n cells across, "
            "5 n along.";
  s.reference = w.has("S03_cantilever_small") ? "Quadratic tets of CalculiX on 32 x 6 x 6 cells; shaded: how far they moved since 20 x 4 x 4. Tip."
                                              : "Reference not at hand: compared with Timoshenko's beam, good to 1 %. Tip.";
  s.measure = cantilever_on_lattices();
  s.real_time = false;
  s.cost_axis = "wall seconds of a solve";
  s.more = {kCellSize};
  for (const auto& [name, lattice] : {std::pair{"linear tets, Kuhn", Lattice::kuhn}, {"linear tets, FEMFX lattice", Lattice::femfx}, {"linear tets, BCC", Lattice::bcc}}) {
    s.curves.push_back({name, knobs::cells({1, 2, 3, 4, 6, 8}, 8), {.lattice = lattice}, 2});
  }
  for (const auto& [name, lattice] : {std::pair{"smoothed octahedra, Kuhn", Lattice::kuhn}, {"smoothed octahedra, BCC", Lattice::bcc}}) {
    s.curves.push_back({name, knobs::cells({1, 2, 3, 4, 6, 8}, 8), {.lattice = lattice, .element = kOctahedra}, 2});
  }
  s.curves.push_back({"hexahedra, Kuhn", knobs::cells({1, 2, 3, 4, 6, 8}, 8), {.element = kHexahedra}, 2});
  return s;
}

Study stored(const Workshop& w) {
  Study s{.name = "cases", .title = "Mesh error of every static case that is stored"};
  s.scene = "The collection's own meshes: cantilever, large deflection, torsion, sphere, first frequency, bunny, Cook's membrane, cylinder.";
  s.reference = "Quadratic tets of CalculiX or closed forms, as the cases name them.";
  s.measure = stored_case();
  s.scene_a_curve = true;
  s.real_time = false;
  s.cost_axis = "wall seconds of a solve";
  struct Row {
    const char *name, *case_name, *field;
    double poisson;
    const char* heavy;
    sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
  };
  const Row rows[] = {{"S03 cantilever", "S03_cantilever_small", "ref_c3d10_at_nodes", 0, ""},
                      {"S04 elastica, corotational", "S04_elastica_large_deflection", "elastica tip", 0, "L1"},
                      {"S05 torsion, torque", "S05_torsion_square_bar", "torque", 0, "L1"},
                      {"S06 sphere", "S06_thick_sphere_pressure", "exact_lame", 0, ""},
                      {"S07 first frequency", "S07_cantilever_frequencies", "first frequency", 0, ""},
                      {"S09 bunny", "S09_bunny_hung", "ref_c3d10_L1_linear", 0, "L1"},
                      {"S10 Cook, nu 0.3", "S10_cook_membrane_nu", "tip", 0.3, ""},
                      {"S10 Cook, nu 0.49", "S10_cook_membrane_nu", "tip", 0.49, ""},
                      {"S10 Cook, nu 0.4999", "S10_cook_membrane_nu", "tip", 0.4999, ""},
                      {"S13 cylinder", "S13_thick_cylinder_pressure", "exact_lame", 0, ""},
                      {"S03 cantilever, octahedra", "S03_cantilever_small", "ref_c3d10_at_nodes", 0, "", kOctahedra},
                      {"S05 torsion, octahedra", "S05_torsion_square_bar", "torque", 0, "L1", kOctahedra},
                      {"S07 first frequency, octahedra", "S07_cantilever_frequencies", "first frequency", 0, "", kOctahedra},
                      {"S09 bunny, octahedra", "S09_bunny_hung", "ref_c3d10_L1_linear", 0, "L1", kOctahedra},
                      {"S10 Cook, nu 0.3, octahedra", "S10_cook_membrane_nu", "tip", 0.3, "", kOctahedra},
                      {"S10 Cook, nu 0.49, octahedra", "S10_cook_membrane_nu", "tip", 0.49, "", kOctahedra},
                      {"S10 Cook, nu 0.4999, octahedra", "S10_cook_membrane_nu", "tip", 0.4999, "", kOctahedra},
                      {"S13 cylinder, octahedra", "S13_thick_cylinder_pressure", "exact_lame", 0, "", kOctahedra},
                      {"S03 cantilever, hexahedra", "S03_cantilever_small", "ref_c3d10_at_nodes", 0, "", kHexahedra},
                      {"S04 elastica, hexahedra", "S04_elastica_large_deflection", "elastica tip", 0, "L1", kHexahedra},
                      {"S05 torsion, hexahedra", "S05_torsion_square_bar", "torque", 0, "L1", kHexahedra},
                      {"S06 sphere, hexahedra", "S06_thick_sphere_pressure", "exact_lame", 0, "", kHexahedra},
                      {"S07 first frequency, hexahedra", "S07_cantilever_frequencies", "first frequency", 0, "", kHexahedra},
                      {"S10 Cook, nu 0.3, hexahedra", "S10_cook_membrane_nu", "tip", 0.3, "", kHexahedra},
                      {"S10 Cook, nu 0.49, hexahedra", "S10_cook_membrane_nu", "tip", 0.49, "", kHexahedra},
                      {"S10 Cook, nu 0.4999, hexahedra", "S10_cook_membrane_nu", "tip", 0.4999, "", kHexahedra},
                      {"S13 cylinder, hexahedra", "S13_thick_cylinder_pressure", "exact_lame", 0, "", kHexahedra}};
  const Setup bunny{.element = kOctahedra, .case_name = "S09_bunny_hung", .level = "L0", .field = "ref_c3d10_L1_linear"};
  s.curves.push_back({"S09 bunny, octahedra of an enclosing lattice", knobs::enclosing({0.014, 0.01, 0.0085, 0.007}, 0.01), bunny, 0,
                      "the finest of four is solved in a quarter of a minute"});
  for (const Row& r : rows) {
    if (!w.has(r.case_name)) s.unmet = "Reference not at hand: the collection of static cases was not found.";
    s.curves.push_back({r.name, knobs::levels({"L0", "L1"}, r.heavy), {.element = r.element, .case_name = r.case_name, .field = r.field, .poisson = r.poisson}, 0, kTwoLevels});
  }
  return s;
}

Study precision() {
  Study s{.name = "precision", .title = "Float against double"};
  s.scene = "S03's cantilever by a direct solve whose factor is in float; beam meshes of growing size.";
  s.reference = "The same solve in double.";
  s.measure = static_precision();
  s.kind = FigureKind::against_value;
  s.real_time = false;
  s.value_axis = "1 / cells across";
  s.curves = {{"float factor, Kuhn", knobs::cells({1, 2, 3, 4, 6, 8}, 8), {.precision = Precision::single}},
              {"float factor, BCC", knobs::cells({1, 2, 3, 4, 6}, 6), {.precision = Precision::single, .lattice = Lattice::bcc}}};
  return s;
}

Study law() {
  Study s{.name = "law", .title = "Model error: the corotational law against St. Venant-Kirchhoff"};
  s.scene = "A material point, E = 1 MPa, nu = 0.3: simple shear, and stretch with the sides held.";
  s.reference = "St. Venant-Kirchhoff's first Piola stress in closed form. Neither law is the truth: the gap says from what strain on the choice matters.";
  s.measure = law_gap_in_shear();
  s.kind = FigureKind::against_value;
  s.error_axis = "relative gap of the stress";
  s.real_time = false;
  s.value_axis = "strain";
  s.curves = {{"simple shear", knobs::strain(), {}, 1}};
  return s;
}

Study law_stretch() {
  Study s = law();
  s.name = "law-stretch";
  s.title = "The same in stretch";
  s.measure = law_gap_in_stretch();
  s.curves = {{"stretch", knobs::strain(), {}, 1}};
  return s;
}

Study law_cases(const Workshop& w) {
  Study s{.name = "law-cases", .title = "The same for whole bodies"};
  s.scene = "Stored cases at large deflection: the elastica, a bar twisted by 45 degrees, the hung bunny.";
  s.reference = "CalculiX with St. Venant-Kirchhoff on the same mesh; relative L2 of the displacement.";
  s.measure = law_gap_of_case();
  s.ranked = false;
  s.real_time = false;
  s.error_axis = "relative gap of the displacement";
  s.cost_axis = "wall seconds of a solve";
  if (!w.has("S04_elastica_large_deflection")) s.unmet = "Reference not at hand: the collection of static cases was not found.";
  s.curves = {{"S04 elastica", knobs::levels({"L0", "L1"}, "L1"), {.case_name = "S04_elastica_large_deflection", .field = "ccx_c3d4_nlgeom"}, 0, kTwoLevels},
              {"S05 torsion by 45 degrees", knobs::levels({"L0_45deg"}), {.case_name = "S05_torsion_square_bar", .field = "ccx_c3d4_nlgeom"}, 0, "one level is stored"},
              {"S09 bunny", knobs::levels({"L0"}, "L0"), {.case_name = "S09_bunny_hung", .field = "ccx_c3d4_nlgeom"}, 0, "one level is stored"}};
  return s;
}

Study dents() {
  Study s{.name = "dent", .title = "Model error: one dent, three models"};
  s.scene = "A block of 0.6 x 0.4 x 0.4 m and 96 kg struck on one side by 500 N s: the shape that stays after half a second, its rigid motion taken out.";
  s.reference = "Our own finest finite elements (16 cells across, plastic); shaded: how far they moved since the next coarser mesh. Not a reference from elsewhere.";
  s.measure = dent();
  s.more = {kIterations};
  s.curves = {{"finite elements, cells across", knobs::cells({2, 4, 6, 8, 10}, 6), {.dt = 1.0 / 240}},
              {"example-based, example fitted to the dent, alpha", knobs::alpha({10, 30, 100, 200, 400, 800, 1600}), {.dt = 1.0 / 240, .body = BodyKind::fitted_rig}},
              {"example-based, generated rig, alpha", knobs::alpha({0.3, 0.6, 1, 2, 4, 8, 16}), {.dt = 1.0 / 240, .body = BodyKind::default_rig}},
              {"rigid", {"-", {{1, "rigid"}}, [](Setup&, double) {}}, {.dt = 1.0 / 240, .body = BodyKind::rigid}, 0, "a rigid body has no setting that dents"}};
  return s;
}

Study sink() {
  Study s{.name = "sink", .title = "Contact: how fast a resting block sinks under the paper's damping"};
  s.scene = "A block of 1 m and 1000 kg at rest on a plane, raw damping contact, dt = 1/60 s, two seconds.";
  s.reference = "The formula v = m g / (phi A). The smaller the speed, the better the contact; the error says that the formula holds.";
  s.measure = sinking_block();
  s.kind = FigureKind::against_value;
  s.error_axis = "relative error of the sinking speed";
  s.value_axis = "phi [N s/m3]";
  s.curves = {{"paper's damping contact", knobs::phi(), {}}};
  return s;
}

Study rest() {
  Study s{.name = "rest", .title = "Contact: how deep a resting block stands in the ground"};
  s.scene = "A block of 1 m, 1000 kg, E = 10 MPa, two seconds on a plane, the default contact law.";
  s.reference = "No overlap at all. Depth by the block's edge.";
  s.measure = resting_block();
  s.error_axis = "depth / edge";
  s.more = {kIterations};
  s.curves = {{"dt", knobs::dt(), {}}, {"kappa, dt = 1/60", knobs::kappa(), {}}};
  return s;
}

Study friction() {
  Study s{.name = "friction", .title = "Contact: friction on a slope"};
  s.scene = "A block of 0.5 m on a slope of 30 degrees, from the first to the second second.";
  s.reference = "a = g (sin - mu cos).";
  s.measure = sliding_block(0.3);
  s.error_axis = "relative error of the acceleration";
  s.more = {kDt, kIterations};
  s.curves = {{"slides, mu = 0.3", knobs::dt(), {}}};
  return s;
}

Study stick() {
  Study s{.name = "stick", .title = "Contact: a block that must hold"};
  s.scene = "A block of 0.5 m on a slope of 26.0 degrees, mu = 0.5: it holds below 26.565 degrees.";
  s.reference = "No motion. Drift in two seconds by the block's edge.";
  s.measure = sticking_block();
  s.error_axis = "drift / edge";
  s.more = {kDt, kIterations};
  s.curves = {{"sticks, mu = 0.5", knobs::dt(), {}}};
  return s;
}

Study codecs() {
  Study s{.name = "wire", .title = "The wire: what a byte buys"};
  s.scene = "A frame of beam B in motion, through the codec and back, 60 frames a second; five sizes of the body.";
  s.reference = "The exact node positions; RMS by the beam's length.";
  s.measure = wire();
  s.error_axis = "RMS error / length";
  s.more = {{"bytes_a_vertex", "bytes a vertex"}};
  const auto sizes = knobs::cells({2, 4, 6, 8, 10}, 8);
  s.curves = {{"16 bit", sizes, {.codec = Codec::quantised16, .compress = false}},
              {"16 bit, zstd", sizes, {.codec = Codec::quantised16, .compress = true}},
              {"float", sizes, {.codec = Codec::float32, .compress = false}},
              {"float, zstd", sizes, {.codec = Codec::float32, .compress = true}}};
  return s;
}

Study threads() {
  Study s{.name = "threads", .title = "Threads"};
  s.scene = text(kBeamB, ", its first quarter of a second; dt = 1/60 s, tolerance 1e-3.");
  s.reference = "None: the bits do not depend on the number of threads.";
  s.measure = beam_cost();
  s.kind = FigureKind::cost;
  s.value_axis = "threads";
  const std::string few = text("this process may use ", allowed_processors(), " processors");
  for (const auto& [solver, kind] : {std::pair{"multigrid", SolverKind::multigrid}, {"block-Jacobi", SolverKind::jacobi}}) {
    for (const auto& [name, cells] : {std::pair{"2,400 tets", 4}, {"12,348 tets", 7}, {"26,244 tets", 9}}) {
      Curve curve{text(name, ", ", solver), knobs::threads(), {.solver = kind, .cells = cells}, 0, few};
      for (KnobValue& v : curve.knob.values) v.heavy = cells > 7;
      s.curves.push_back(curve);
    }
  }
  return s;
}

Study beam_b() {
  Study s{.name = "beam-b", .title = "Beam B at rest, and what others reach on it"};
  s.scene = "Beam B with mass damping until it rests (four seconds), dt = 1/60 s, tolerance 1e-3.";
  s.reference = "Tip of the converged three-dimensional corotational solution, -0.4793 m. Others' figures are theirs, on their machine.";
  s.measure = beam_at_rest();
  s.more = {kCellSize, kIterations};
  s.curves = {{"linear tets, Kuhn", knobs::cells({2, 3, 4, 6, 8}, 6), {}, 2},
              {"linear tets, BCC", knobs::cells({1, 2, 3, 4, 6}, 4), {.lattice = Lattice::bcc}, 2},
              {"smoothed octahedra, Kuhn", knobs::cells({1, 2, 3, 4, 6}, 4), {.element = kOctahedra}, 2},
              {"smoothed octahedra, BCC", knobs::cells({1, 2, 3, 4, 5}, 4), {.lattice = Lattice::bcc, .element = kOctahedra}, 2},
              {"hexahedra, Kuhn", knobs::cells({1, 2, 3, 4, 6}, 4), {.element = kHexahedra}, 2}};
  // ANCHORS: 2,400 tets, ms a step of 1/60 s and tip at rest.
  const auto peer = [](const char* name, double ms, double tip) { return PeerPoint{name, (0.4793 - tip) / 0.4793, 60 * ms / 1000}; };
  s.peers = {peer("Bullet btDeformable", 11.8, 0.406), peer("Vega corotational", 9.4, 0.405), peer("MuJoCo flex", 7.9, 0.365)};
  return s;
}

Study beam_a_study() {
  Study s{.name = "beam-a", .title = "Beam A: iterations against the equilibrium, and FEMFX"};
  s.scene = "Beam A: 2 x 0.4 x 0.4 m, 2,400 tets, E = 10 MPa, damped, dropped for ten seconds, dt = 1/60 s.";
  s.reference = "Equilibrium of the same mesh, tip -0.11785 m (five digits: 4e-5). FEMFX's figures are its own, on another machine.";
  s.measure = beam_a();
  s.more = {kIterations};
  s.curves = {{"block-Jacobi, cap, no guard", knobs::cg_cap(), {.solver = SolverKind::jacobi, .lattice = Lattice::femfx}},
              {"block-Jacobi, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::jacobi, .lattice = Lattice::femfx}},
              {"multigrid, tolerance", knobs::cg_tolerance(), {.solver = SolverKind::multigrid, .lattice = Lattice::femfx}}};
  for (const std::size_t c : {std::size_t{1}, std::size_t{2}}) s.curves[c].knob.values.resize(5);
  // ANCHORS: 60 iterations, its default cap, hit at every step.
  s.peers = {{"FEMFX, 60 iterations, 1 thread", (0.11785 - 0.11722) / 0.11785, 60 * 1.16e-3}};
  return s;
}

Study pareto() {
  Study s{.name = "pareto", .title = "What a millisecond buys: total error against cost"};
  s.scene = text(kBeamB, "; every pair of dt and CG tolerance on seven meshes and two of hexahedra.");
  s.reference = "The tip of this code's own limit of mesh and dt to zero: small steps by direct solves on a BCC lattice, extrapolated; shaded: its "
                "own uncertainty. Solver, time and mesh error are measured each on its own.";
  s.measure = beam_total_error();
  s.kind = FigureKind::pareto;
  const auto grid = knobs::grid({1.0 / 15, 1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480}, {1e-1, 1e-2, 1e-3}, 1.0 / 130);
  struct Row {
    const char* name;
    Lattice lattice;
    int cells;
    bool heavy;
    Integrator integrator = Integrator::backward_euler;
    sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
  };
  for (const Row& r : {Row{"Kuhn 6x1x1", Lattice::kuhn, 1, true}, {"Kuhn 12x2x2", Lattice::kuhn, 2, false}, {"Kuhn 25x4x4", Lattice::kuhn, 4, true},
                       {"BCC 6x1x1", Lattice::bcc, 1, false}, {"BCC 12x2x2", Lattice::bcc, 2, false}, {"BCC 18x3x3", Lattice::bcc, 3, false},
                       {"BCC 24x4x4", Lattice::bcc, 4, true}, {"BCC 12x2x2, BDF2", Lattice::bcc, 2, false, Integrator::bdf2},
                       {"BCC 24x4x4, BDF2", Lattice::bcc, 4, true, Integrator::bdf2},
                       {"hexahedra 6x1x1, BDF2", Lattice::kuhn, 1, false, Integrator::bdf2, kHexahedra},
                       {"hexahedra 12x2x2, BDF2", Lattice::kuhn, 2, false, Integrator::bdf2, kHexahedra}}) {
    Curve curve{r.name, grid, {.integrator = r.integrator, .lattice = r.lattice, .element = r.element, .cells = r.cells}};
    if (r.heavy) {
      for (KnobValue& v : curve.knob.values) v.heavy = true;
    }
    s.curves.push_back(curve);
  }
  return s;
}

// The settings that an ensemble is run at.
Knob ensemble_settings() {
  Knob knob{"setting",
            {{0, "dt 1/30"}, {1, "dt 1/60, 1e-1"}, {2, "dt 1/60, 1e-2"}, {3, "dt 1/60, 1e-3"}, {4, "dt 1/120"}},
            [](Setup& s, double v) {
              const Setup settings[] = {{.dt = 1.0 / 30}, {.cg_tolerance = 1e-1}, {.cg_tolerance = 1e-2}, {}, {.dt = 1.0 / 120}};
              s.dt = settings[static_cast<int>(v)].dt;
              s.cg_tolerance = settings[static_cast<int>(v)].cg_tolerance;
            }};
  for (KnobValue& v : knob.values) v.heavy = v.value != 3;
  return knob;
}

Study pile() {
  Study s{.name = "pile", .title = "Chaos: a pile of 64 soft cubes"};
  s.scene = "64 cubes of 1 m dropped between planes, four seconds, each start moved by up to 1 mm by its seed.";
  s.reference = "None: chaotic. Statistics over seeds; bands from the lower to the upper quartile.";
  s.measure = pile_ensemble();
  s.kind = FigureKind::ensemble;
  s.seeds = true;
  s.statistics = {"peak_speed", "settle_time", "mean_height", "penetration_mm", "seconds", "ms_worst"};
  s.curves = {{"settings", ensemble_settings(), {}}};
  s.peers = {{"FEMFX, 1 thread", 0, 60 * 7.25e-3}};
  return s;
}

Study panel() {
  Study s{.name = "panel", .title = "Chaos: a panel of 2,400 tets that breaks"};
  s.scene = "A panel of 2 x 2 x 0.05 m struck by a box of 20 kg at 40 m/s, one second, the strike moved by up to 1 mm by its seed.";
  s.reference = "None: chaotic. Statistics over seeds; bands from the lower to the upper quartile.";
  s.measure = panel_ensemble();
  s.kind = FigureKind::ensemble;
  s.seeds = true;
  s.statistics = {"fragments", "largest_piece", "peak_impulse", "settle_time", "seconds", "ms_worst"};
  s.curves = {{"settings", ensemble_settings(), {}}};
  s.peers = {{"FEMFX, 1 thread", 0, 60 * 35e-3}};
  return s;
}

}  // namespace

std::vector<Study> studies(const Workshop& w) {
  return {pareto(), solver(),  time(w), lattices(w), stored(w), precision(), law(),    law_stretch(), law_cases(w), dents(),
          sink(),   rest(),    friction(), stick(),  codecs(),  threads(),   beam_b(), beam_a_study(), pile(),      panel()};
}

std::vector<NotBuilt> not_built() {
  return {{"integrators: Newmark, TR-BDF2, backward Euler with a full Newton solve, explicit", "only linearised backward Euler and BDF2 exist"},
          {"elements: quadratic tets, strain averaged around every edge", "linear tets, smoothed octahedra and hexahedra exist"},
          {"materials: St. Venant-Kirchhoff, stable neo-Hookean", "only the corotational law exists"},
          {"codec levels of zstd", "one level is built in; compression is on or off"}};
}

}  // namespace crumple::lab::chart
