// crumple-lab: accuracy and speed. One JSON object on standard output, progress and logs on standard error.
// Exit: 0 done; 2 bad input; 3 a solve that did not converge (its residual is printed); 1 anything else.
#include "server/io/scene_file.h"
#include "server/lab/benchmark.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/chart/chart_command.h"
#include "server/lab/chart/example_tables_command.h"
#include "server/lab/chart/timeline_command.h"
#include "server/lab/command_output.h"
#include "server/lab/destruction_scenes.h"
#include "server/lab/example_kernels.h"
#include "server/lab/example_replay.h"
#include "server/lab/impulse_tuning.h"
#include "server/lab/material_preview.h"
#include "server/lab/material_replay.h"
#include "server/lab/roofline.h"
#include "server/lab/split_times.h"
#include "server/lab/stability/stability_command.h"
#include "server/lab/static_solve.h"
#include "server/lab/step_comparison.h"
#include "server/lab/trajectory.h"
#include "server/lab/vibration_modes.h"

#include <CLI/CLI.hpp>

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

using namespace crumple;
using lab::fail;
using lab::Json;
using lab::print;

namespace {

Json rows(const std::vector<Vec3>& vectors) {
  Json list = Json::array();
  for (const Vec3& v : vectors) list.push_back({v.x(), v.y(), v.z()});
  return list;
}

sim::fem::ElementKind element_kind(const std::string& name) {
  if (name == "hexahedra") return sim::fem::ElementKind::hexahedra;
  return name == "octahedra" ? sim::fem::ElementKind::smoothed_octahedra : sim::fem::ElementKind::linear_tetrahedra;
}

struct SolveCommand {
  std::string case_dir, level, model = "corotational", precision = "double", out;
  lab::MaterialOverride material;

  int run() const {
    auto loaded = lab::read_level(case_dir, level);
    if (!loaded) return fail(loaded.error());
    auto m = lab::read_material(case_dir, material);
    if (!m) return fail(m.error());
    const auto solved = lab::solve_static(*loaded, *m, model == "linear" ? lab::Model::linear : lab::Model::corotational,
                                          precision == "float" ? lab::Precision::single : lab::Precision::double_);
    if (!solved) return fail(solved.error());
    const lab::StaticSolution& solution = *solved;
    const Json outcome{{"converged", solution.converged}, {"residual", solution.residual}, {"iterations", solution.iterations}};
    if (!solution.converged) {
      print(outcome);
      std::cerr << "crumple-lab: not converged, relative residual " << solution.residual << "\n";
      return 3;
    }
    const Json result{{"displacements", rows(solution.displacements)}, {"reactions", rows(solution.reactions)}};
    if (out.empty()) return print(result);
    std::ofstream file(out);
    file << result.dump() << "\n";
    file.close();
    if (!file) return fail({ErrorCode::invalid_argument, "--out", "is " + out + ", which cannot be written"});
    return print(outcome);
  }
};

struct TrajectoryCommand {
  std::string case_dir, run_name, integrator = "backward_euler";
  double dt = 1.0 / 60;
  int substeps = 1;
  lab::MaterialOverride material;

  int run() const {
    auto t = lab::run_trajectory(case_dir, run_name, dt, substeps, integrator, material);
    if (!t) return fail(t.error());
    Json result{{"t", t->times}, {"tip", rows(t->tip)}, {"tip_uz", t->tip_uz}, {"momentum", rows(t->momentum)},
                {"angular_momentum", rows(t->angular_momentum)}, {"kinetic", t->kinetic}, {"elastic", t->elastic},
                {"gravitational", t->gravitational}, {"energy", t->energy}, {"snapshots", Json::object()}};
    for (const auto& [time, x] : t->snapshots) result["snapshots"][Json(time).dump()] = rows(x);
    return print(result);
  }
};

// "cannonballs, dock, ..."
std::string destruction_names() {
  std::string names;
  for (const auto& [name, steps] : lab::destruction_steps()) names += (names.empty() ? "" : ", ") + name;
  return names;
}

struct SceneToStep {
  sim::SceneDescription scene;
  int steps;  // that show what happens
};

// A scene of Jones et al. 2016 by its name, or a scene file.
Result<SceneToStep> scene_to_step(const std::string& scene, std::uint64_t seed = 1) {
  if (const auto known = lab::destruction_steps().find(scene); known != lab::destruction_steps().end()) {
    auto made = lab::destruction_scene(scene, {.seed = seed});
    if (!made) return std::unexpected(made.error());
    return SceneToStep{*std::move(made), known->second};
  }
  auto loaded = io::load_scene(scene);
  if (!loaded) return std::unexpected(loaded.error());
  return SceneToStep{std::move(loaded->scene), 600};
}

struct BenchCommand {
  std::string scene, lattice = "femfx", cells = "25x4x4", size = "2x0.4x0.4", damping = "0.15,0.004", sleep;
  double young = 1e7, poisson = 0.3;
  int threads = 1, steps = 0;
  bool invariants = false, depth = false;
  std::uint64_t seed = 1;
  std::string solver, precision, integrator;
  double tolerance = 0, kappa = 0, recovery_steps = 0, rigid_tolerance = 0;
  int rigid_iterations = 0;
  std::string element;
  std::string collision;

  // What the command line says in place of the scene.
  void override_scene(sim::SceneDescription& description) const {
    using sim::linear_solver::SolverKind;
    const std::map<std::string, SolverKind> kinds{{"automatic", SolverKind::automatic}, {"jacobi", SolverKind::jacobi}, {"rigid-modes", SolverKind::rigid_modes}, {"multigrid", SolverKind::multigrid}, {"warped-factor", SolverKind::warped_factor}, {"direct", SolverKind::direct}};
    if (!solver.empty()) description.solver = kinds.at(solver);
    if (!integrator.empty()) {
      description.integrator = integrator == "bdf2" ? sim::Integrator::bdf2 : sim::Integrator::backward_euler;
    }
    if (!precision.empty()) description.float_solver = precision == "float";
    if (rigid_iterations > 0) description.rigid_iterations = rigid_iterations;
    if (kappa > 0) description.contact.kappa = kappa;
    if (recovery_steps > 0) description.contact.recovery_steps = recovery_steps;
    for (sim::BodyDescription& body : description.bodies) {
      auto* fem = std::get_if<sim::FemModel>(&body.model);
      if (fem && tolerance > 0) fem->material.cg_tolerance = tolerance;
      if (fem && !element.empty()) fem->element = element_kind(element);
      auto* example = std::get_if<sim::ExampleModel>(&body.model);
      if (example && !collision.empty()) {
        example->parameters.triangle_collision = collision == "triangles";
        example->parameters.tet_collision = collision == "tets";
      }
    }
  }

  int run() const {
    Result<sim::SceneDescription> description = std::unexpected(Error{});
    lab::BenchmarkOptions options{.threads = threads, .invariants = invariants, .depth = depth, .rigid_tolerance = rigid_tolerance};
    if (scene == "beam") {
      lab::BeamOptions beam{.young = young, .poisson = poisson};
      if (lattice != "femfx") beam.lattice = lattice == "kuhn" ? authoring::Lattice::kuhn : authoring::Lattice::bcc;
      if (std::sscanf(cells.c_str(), "%dx%dx%d", &beam.cells[0], &beam.cells[1], &beam.cells[2]) != 3) {
        return fail({ErrorCode::invalid_argument, "--cells", "is " + cells + ", must be like 25x4x4"});
      }
      if (std::sscanf(size.c_str(), "%lfx%lfx%lf", &beam.size[0], &beam.size[1], &beam.size[2]) != 3) {
        return fail({ErrorCode::invalid_argument, "--size", "is " + size + ", must be like 2x0.4x0.4"});
      }
      if (std::sscanf(damping.c_str(), "%lf,%lf", &beam.damping_mass, &beam.damping_stiffness) != 2) {
        return fail({ErrorCode::invalid_argument, "--damping", "is " + damping + ", must be like 0.15,0.004"});
      }
      description = lab::beam_scene(beam);
      options.tip = "beam";
      options.steps = 600;
    } else if (scene == "pile") {
      description = lab::pile_scene();
      options.steps = 300;
    } else if (scene == "panel") {
      description = lab::panel_scene();
      options.steps = 180;
    } else if (scene == "barrels") {
      description = lab::barrels_scene(seed);
      options.steps = 1000;
    } else if (!lab::destruction_steps().contains(scene) && !std::filesystem::exists(scene)) {
      return fail({ErrorCode::invalid_argument, "scene", "is " + scene + ", must be beam, pile, panel, barrels, " + destruction_names() + " or a scene file"});
    } else {
      auto found = scene_to_step(scene, seed);
      if (!found) return fail(found.error());
      description = std::move(found->scene);
      options.steps = found->steps;
    }
    if (!description) return fail(description.error());
    if (steps > 0) options.steps = steps;
    override_scene(*description);
    if (sleep == "on") description->sleep = {};
    if (sleep == "off") description->sleep.speed = 0;
    const bool terminal = isatty(STDERR_FILENO);
    const auto result = lab::run_benchmark(*description, options, [&](int k) {
      if (terminal && (k % 10 == 0 || k == options.steps)) std::cerr << "\r" << scene << " " << k << "/" << options.steps << std::flush;
    });
    if (terminal) std::cerr << "\n";
    if (!result) return fail(result.error());
    return print(*result);
  }
};

void add_material(CLI::App* command, lab::MaterialOverride& material) {
  command->add_option("--young", material.young, "E [Pa], instead of the case's");
  command->add_option("--nu", material.poisson, "Poisson's ratio, instead of the case's");
  command->add_option_function<std::string>("--element", [&](const std::string& name) { material.element = element_kind(name); },
                                            "tets: linear; octahedra: smoothed over long edges; hexahedra: cells of six tets")
      ->check(CLI::IsMember({"tets", "octahedra", "hexahedra"}));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Accuracy and speed of the simulation. Prints one JSON object; exit 2: bad input, 3: not converged."};
  app.require_subcommand(1);
  int exit_code = 0;

  SolveCommand solve;
  auto* s = app.add_subcommand("solve", "static equilibrium of a case's level: displacements and reactions [m, N], a row a node");
  s->add_option("case", solve.case_dir, "folder with case.json and level files")->required();
  s->add_option("level", solve.level, "level file's name without .json")->required();
  s->add_option("--model", solve.model)->check(CLI::IsMember({"linear", "corotational"}))->capture_default_str();
  s->add_option("--precision", solve.precision, "of the matrix and its factor")->check(CLI::IsMember({"double", "float"}))->capture_default_str();
  s->add_option("--out", solve.out, "write the result here and print the outcome only");
  add_material(s, solve.material);
  s->callback([&] { exit_code = solve.run(); });

  std::string modes_dir, modes_level;
  int count = 14;
  lab::MaterialOverride modes_material;
  auto* m = app.add_subcommand("modes", "lowest natural frequencies with lumped mass [Hz]");
  m->add_option("case", modes_dir)->required();
  m->add_option("level", modes_level)->required();
  m->add_option("--count", count)->capture_default_str();
  add_material(m, modes_material);
  m->callback([&] {
    auto level = lab::read_level(modes_dir, modes_level);
    auto material = lab::read_material(modes_dir, modes_material);
    if (!level || !material) {
      exit_code = fail(!level ? level.error() : material.error());
      return;
    }
    auto frequencies = lab::natural_frequencies(*level, *material, count);
    exit_code = frequencies ? print({{"lumped_Hz", *frequencies}}) : fail(frequencies.error());
  });

  std::string replay_dir;
  auto* r = app.add_subcommand("material", "replays a material case's paths.json or states.json");
  r->add_option("case", replay_dir)->required();
  r->callback([&] {
    auto report = lab::replay_material(replay_dir);
    if (!report) {
      exit_code = fail(report.error());
      return;
    }
    lab::Json result{{"max_relative_error", report->max_relative_error}, {"by_test", report->by_test}};
    if (report->j2_calculix) result["j2_calculix"] = *report->j2_calculix;
    exit_code = print(result);
  });

  std::string tuned_scene;
  int tuned_steps = 0, tuned_threads = 1;
  auto* u = app.add_subcommand("tune", "steps a scene, shows the impulses on its example-based bodies, and suggests alpha and beta");
  u->add_option("scene", tuned_scene, "a scene file, or " + destruction_names())->required();
  u->add_option("--steps", tuned_steps, "default: as bench")->check(CLI::Range(1, 10'000'000));
  u->add_option("--threads", tuned_threads)->check(CLI::Range(1, 256))->capture_default_str();
  u->callback([&] {
    const auto found = scene_to_step(tuned_scene);
    if (!found) {
      exit_code = fail(found.error());
      return;
    }
    const int steps = tuned_steps > 0 ? tuned_steps : found->steps;
    const auto result = lab::suggest_parameters(found->scene, {.threads = tuned_threads, .steps = steps});
    exit_code = result ? print(*result) : fail(result.error());
  });

  std::string replayed, replay_out;
  auto* x = app.add_subcommand("example", "replays a case of example-based plasticity: every intermediate of Jones et al. 2016, eqs. 1-15");
  x->add_option("case", replayed, "case.json")->required();
  x->add_option("--out", replay_out, "file for the result; default: standard output");
  x->callback([&] {
    auto result = lab::replay_example(replayed);
    if (!result) {
      exit_code = fail(result.error());
    } else if (replay_out.empty()) {
      exit_code = print(*result);
    } else {
      std::ofstream file(replay_out);
      file << result->dump() << "\n";
      exit_code = file.flush() ? print({{"frames", (*result)["outputs"]["frames"].size()}})
                               : fail({ErrorCode::invalid_argument, "--out", "cannot be written: " + replay_out});
    }
  });

  lab::ExampleKernelOptions kernels;
  auto* e = app.add_subcommand("kernels", "skinning of the generated car, and one impulse on it: medians alone, in microseconds");
  e->add_option("--cell-size", kernels.cell_size, "of the car's lattice [m]")->capture_default_str();
  e->add_option("--threads", kernels.threads)->check(CLI::Range(1, 256))->capture_default_str();
  e->add_option("--repeats", kernels.repeats)->capture_default_str();
  e->callback([&] {
    const auto result = lab::time_example_kernels(kernels);
    exit_code = result ? print(*result) : fail(result.error());
  });

  lab::SplitTimesOptions splits;
  auto* splits_command = app.add_subcommand("splits", "multigrid's coarse levels after random splits: followed, and made anew, in microseconds");
  splits_command->add_option("--cells", splits.cells, "of a block, along x, y and z")->delimiter(',')->capture_default_str();
  splits_command->add_option("--splits", splits.splits)->capture_default_str();
  splits_command->callback([&] {
    const auto result = lab::time_splits(splits);
    exit_code = result ? print(*result) : fail(result.error());
  });

  lab::RooflineOptions roofline;
  bool roofline_json = false;
  auto* w = app.add_subcommand("roofline", "the solver's hot loops: bytes moved over the machine's memory bandwidth, as a table");
  w->add_option("--cells", roofline.cells, "x,y,z: of beam A")->delimiter(',')->capture_default_str();
  w->add_option("--threads", roofline.threads, "1,2: numbers of threads to measure with")->delimiter(',')->capture_default_str();
  w->add_option("--stream-mb", roofline.stream_mb, "of each of the triad's three arrays")->capture_default_str();
  w->add_option("--repeats", roofline.repeats)->capture_default_str();
  w->add_flag("--json", roofline_json, "the numbers instead of the table");
  w->callback([&] {
    const auto result = lab::measure_roofline(roofline);
    if (!result) exit_code = fail(result.error());
    else if (roofline_json) exit_code = print(*result);
    else std::cout << lab::roofline_table(*result);
  });

  TrajectoryCommand trajectory;
  lab::PreviewFiles preview;
  std::string preview_out = "preview";
  auto* v = app.add_subcommand("preview", "panels of a material pushed, bent and struck: a picture and a scene");
  v->add_option("material", preview.material, "JSON file of a FemMaterial, as in deploy/materials")->required();
  v->add_option("--splinters", preview.splinters, "JSON file of Splinters, as in deploy/splinters; default: none");
  v->add_option("--out", preview_out, "folder for preview.svg and preview.json")->capture_default_str();
  v->callback([&] {
    auto result = lab::preview_material(preview, preview_out);
    exit_code = result ? print(*result) : fail(result.error());
  });

  lab::StepComparison steps;
  std::vector<double> from;
  auto* k = app.add_subcommand("steps", "a scene with eq. 8, 9 and 10 of example-based deformation side by side, as a picture");
  k->add_option("scene", steps.scene, "a scene file")->required();
  k->add_option("--times", steps.times, "rows of the picture [s]: 1,2")->delimiter(',');
  k->add_option("--alphas", steps.alphas, "a,b,c: alpha with eq. 8 [1/m], 9 [-], 10 [1/m^2]; default: the scene's")->delimiter(',');
  k->add_option("--from", from, "x,y,z: where the camera stands, seen from the bodies")->delimiter(',')->expected(3);
  k->add_option("--picture", steps.picture, "a .png: columns are eq. 8, 9, 10")->required();
  k->callback([&] {
    if (from.size() == 3) steps.from = Vec3(from[0], from[1], from[2]);
    auto result = lab::compare_steps(steps);
    exit_code = result ? print(*result) : fail(result.error());
  });

  auto* t = app.add_subcommand("trajectory", "steps a run that case.json names");
  t->add_option("case", trajectory.case_dir)->required();
  t->add_option("--run", trajectory.run_name)->required();
  t->add_option("--dt", trajectory.dt, "time between two entries of the result [s]")->required();
  t->add_option("--substeps", trajectory.substeps, "steps in each dt")->capture_default_str();
  t->add_option("--integrator", trajectory.integrator, "backward_euler or bdf2")->capture_default_str();
  add_material(t, trajectory.material);
  t->callback([&] { exit_code = trajectory.run(); });

  BenchCommand bench;
  bool json = false;
  auto* b = app.add_subcommand("bench", "steps a benchmark scene and reports time, accuracy and state hash");
  b->add_option("scene", bench.scene, "beam, pile, panel, barrels; of example-based bodies " + destruction_names() + "; or a scene file")->required();
  b->add_option("--threads", bench.threads)->check(CLI::Range(1, 256))->capture_default_str();
  b->add_option("--steps", bench.steps, "default: beam 600, pile 300, panel 180, barrels 1000, a scene file 600, others as long as things happen")->check(CLI::Range(1, 10'000'000));
  b->add_option("--lattice", bench.lattice, "beam")->check(CLI::IsMember({"femfx", "kuhn", "bcc"}))->capture_default_str();
  b->add_option("--cells", bench.cells, "beam")->capture_default_str();
  b->add_option("--size", bench.size, "beam [m]")->capture_default_str();
  b->add_option("--young", bench.young, "beam [Pa]")->capture_default_str();
  b->add_option("--nu", bench.poisson, "beam")->capture_default_str();
  b->add_option("--damping", bench.damping, "beam: a,b of C = a M + b K")->capture_default_str();
  b->add_option("--sleep", bench.sleep, "on: as scenes by default; off; else as the scene says: beam, pile, panel and barrels never sleep")
      ->check(CLI::IsMember({"on", "off"}));
  b->add_option("--collision", bench.collision, "of example-based bodies, instead of the scene's (benchmark scenes: parts)")->check(CLI::IsMember({"triangles", "parts", "tets"}));
  b->add_option("--seed", bench.seed, "barrels, pachinko, pegs, space")->capture_default_str();
  b->add_option("--solver", bench.solver, "instead of the scene's")->check(CLI::IsMember({"automatic", "jacobi", "rigid-modes", "multigrid", "warped-factor", "direct"}));
  b->add_option("--precision", bench.precision, "of the matrix, instead of the scene's or what the bodies allow")->check(CLI::IsMember({"double", "float"}));
  b->add_option("--tolerance", bench.tolerance, "relative residual of the solves, instead of the materials'")->check(CLI::Range(1e-14, 0.5));
  b->add_option("--integrator", bench.integrator, "instead of the scene's")->check(CLI::IsMember({"backward_euler", "bdf2"}));
  b->add_option("--rigid-iterations", bench.rigid_iterations, "of the rigid solver at most, instead of the scene's")->check(CLI::Range(1, 10'000));
  b->add_option("--rigid-tolerance", bench.rigid_tolerance, "of the rigid solver [m/s], instead of its own")->check(CLI::Range(1e-15, 1.0));
  b->add_option("--element", bench.element, "of finite-element bodies, instead of the scene's")->check(CLI::IsMember({"tets", "octahedra", "hexahedra"}));
  b->add_option("--kappa", bench.kappa, "of contact, instead of the scene's")->check(CLI::Range(1e-3, 1e6));
  b->add_option("--recovery-steps", bench.recovery_steps, "of contact, instead of the scene's")->check(CLI::Range(1.0, 1e6));
  b->add_flag("--depth", bench.depth, "how deep finite-element bodies are in each other and under planes after every step, and for how long");
  b->add_flag("--invariants", bench.invariants, "momentum, energy and work of every step");
  b->add_flag("--json", json, "the output is JSON always; accepted for scripts that say so");
  b->callback([&] { exit_code = bench.run(); });

  lab::chart::add_chart_command(app, exit_code);
  lab::chart::add_timeline_command(app, exit_code);
  lab::chart::add_example_tables_command(app, exit_code);

  lab::stability::add_command(app, exit_code);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return exit_code;
}
