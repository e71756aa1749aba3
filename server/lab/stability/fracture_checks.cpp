#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/lab/stability/step_times.h"
#include "server/lab/stability/stored_mesh.h"
#include "server/sim/fem/plasticity.h"
#include "server/sim/fracture/fragments.h"
#include "server/sim/fracture/mesh_split.h"
#include "server/sim/world.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

// Rows about bodies that break and bodies that flow.
namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;

constexpr double kDt = 1.0 / 60;   // [s]
constexpr double kEdge = 0.1;      // of a cell [m]
constexpr double kStrength = 1e4;  // [Pa]
constexpr int kMaxSplits = 20;     // a step

std::vector<int> nodes_at(const sim::TetMesh& mesh, double x) {
  std::vector<int> nodes;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (std::abs(mesh.X[i].x() - x) < 1e-9) nodes.push_back(i);
  return nodes;
}

// A breakable bar along x, E = 1e6 Pa, whose far end goes to `to` within 0.25 s and stays; the near one is held.
sim::SceneDescription bar(const Method& method, const std::array<int, 3>& cells, const Pose& to, std::uint64_t seed) {
  sim::SceneDescription scene{.name = "bar", .gravity = Vec3::Zero(), .dt = kDt, .seed = seed};
  scene.integrator = method.fem.integrator;
  scene.unguarded = true;
  scene.sleep.speed = 0;
  const Vec3 size = kEdge * Vec3(cells[0], cells[1], cells[2]);
  sim::TetMesh mesh = block(size, cells);
  for (Vec3& X : mesh.X) X -= Vec3(0, size.y() / 2, size.z() / 2);  // turns about its axis
  sim::FemModel model;
  model.element = method.fem.element;
  model.material.breakable = true;
  model.material.raw_toughness = method.raw;
  model.material.toughness = method.raw ? kStrength * kEdge * kEdge : kStrength;
  model.material.max_splits_per_step = kMaxSplits;
  model.motions.push_back({nodes_at(mesh, 0), {}});
  model.motions.push_back({nodes_at(mesh, size.x()), {{0, Pose{}}, {0.25, to}}});
  model.mesh = std::make_shared<sim::TetMesh>(std::move(mesh));
  scene.bodies.push_back({.name = "bar", .model = model});
  return scene;
}

struct Broken {
  bool sound = true;
  int splits = 0, fragments = 1;
  int most_in_a_step = 0;  // for each piece that deformed before it: the cap is a piece's
  double gain = 0;  // largest energy after the end stopped, over that when it stopped, minus 1
};

Broken pull(const Method& method, const sim::SceneDescription& scene, double seconds) {
  auto world = std::move(sim::World::create(scene).value());
  Broken result;
  double stopped = 0, largest = 0;
  std::vector<double> times;
  for (int k = 0; k < std::lround(seconds / kDt); ++k) {
    const sim::FemView before = world->fem(0);
    const int pieces = std::max(1, before.fragments - before.rigid_fragments);
    const double from = processor_time();
    const sim::StepReport report = world->step();
    times.push_back(processor_time() - from);
    result.splits += report.splits;
    result.most_in_a_step = std::max(result.most_in_a_step, (report.splits + pieces - 1) / pieces);
    const sim::Energies e = world->energies();
    const double energy = e.kinetic + e.elastic;
    if (world->time() < 0.25 + kDt)
      stopped = std::max(stopped, energy);
    else
      largest = std::max(largest, energy);
    for (const sim::Event& event : world->take_events())
      result.sound = result.sound && event.kind != sim::EventKind::frozen;
  }
  const sim::FemView view = world->fem(0);
  result.fragments = view.fragments;
  for (const Vec3& x : view.x) result.sound = result.sound && x.allFinite() && x.norm() < 100;
  result.gain = stopped > 0 ? std::max(0.0, largest / stopped - 1) : 0;
  if (method.times) method.times->add(std::move(times));
  return result;
}

Outcome cascade(const Method& method, const Effort& effort) {
  const std::array<int, 3> cells{8, 2, 2};
  Broken worst;
  std::string found;
  // 1.01 and 10 times the stress that parts the bar: E eps = s.
  for (const double factor : {1.01, 10.0}) {
    const Broken result =
        pull(method, bar(method, cells, {Quat::Identity(), Vec3(8 * kEdge * factor * kStrength / 1e6, 0, 0)}, 1),
             effort.brief ? 1 : 3);
    found += text(" pulled to ", factor, " s_c: ", result.splits, " splits (", result.most_in_a_step, " a piece and step), ",
                  result.fragments, " pieces;");
    worst.sound = worst.sound && result.sound;
    worst.most_in_a_step = std::max(worst.most_in_a_step, result.most_in_a_step);
    worst.gain = std::max(worst.gain, result.gain);
  }
  const Pose turned{Quat(Eigen::AngleAxisd(0.9 * std::numbers::pi, Vec3::UnitX())), Vec3::Zero()};
  const Broken twist = pull(method, bar(method, cells, turned, 1), effort.brief ? 1 : 3);
  found += text(" twisted: ", twist.splits, " splits, ", twist.fragments, " pieces;");
  worst.sound = worst.sound && twist.sound;
  worst.most_in_a_step = std::max(worst.most_in_a_step, twist.most_in_a_step);
  worst.gain = std::max(worst.gain, twist.gain);
  return judged(
      worst.sound, worst.most_in_a_step <= kMaxSplits && worst.gain < 0.01, worst.gain,
      text("cap ", kMaxSplits, " a piece and step:", found, " energy rises by ", 100 * worst.gain, " % after the end stopped"));
}

// Groups of tets of a star that hang together by faces at its node.
int groups_at(const std::vector<Tet>& tets, std::span<const int> star) {
  std::vector<int> open, left(star.begin(), star.end());
  int groups = 0;
  while (!left.empty()) {
    ++groups;
    open = {left.back()};
    left.pop_back();
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (std::size_t k = left.size(); k-- > 0;) {
        long shared = 0;
        for (const int n : tets[t]) shared += std::ranges::count(tets[left[k]], n);
        if (shared < 3) continue;
        open.push_back(left[k]);
        left.erase(left.begin() + static_cast<long>(k));
      }
    }
  }
  return groups;
}

struct Splits {
  int splits = 0, refused = 0, pieces = 0, smallest = 0, joints = 0;
  double change = 0;  // largest of a tet's volume [m^3]
};

Splits split_at_random(sim::TetMesh mesh, int tries) {
  sim::fem::FemState state{mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), {}};
  sim::NodeStars stars(mesh.tets, mesh.node_count());
  std::vector<double> volume;
  for (int t = 0; t < mesh.tet_count(); ++t) volume.push_back(sim::signed_volume(mesh, t));
  Random random(11);
  Splits result;
  for (int done = 0; done < tries; done += 50) {
    std::map<int, sim::fracture::SplitCandidate> candidates;
    while (candidates.size() < 50) {
      const int node = static_cast<int>(random.uniform(0, static_cast<double>(mesh.X.size())));
      candidates[node] = {node, random.vec3(-1, 1).normalized(), 1};
    }
    std::vector<sim::fracture::SplitCandidate> list;
    for (const auto& [node, candidate] : candidates) list.push_back(candidate);
    const auto report = sim::fracture::split_nodes(mesh.tets, state, stars, list,
                                                   {.seed = 3, .step = static_cast<std::uint64_t>(done)});
    sim::fracture::extend_by_origin(mesh.X, report.origin);
    result.splits += static_cast<int>(report.splits.size());
    result.refused += report.refused;
  }
  const auto fragments = sim::fracture::find_fragments(mesh.tets);
  result.pieces = fragments.count();
  result.smallest = std::ranges::min(fragments.size);
  for (int n = 0; n < stars.node_count(); ++n) result.joints += groups_at(mesh.tets, stars[n]) > 1;
  for (int t = 0; t < mesh.tet_count(); ++t)
    result.change = std::max(result.change, std::abs(sim::signed_volume(mesh, t) - volume[t]));
  return result;
}

Outcome floaters(const Method&, const Effort& effort) {
  const int tries = effort.brief ? 2000 : 10'000;
  bool exact = true, holds = true;
  int joints = 0;
  std::string found;
  const auto add = [&](const std::string& name, const sim::TetMesh& mesh) {
    const Splits result = split_at_random(mesh, tries);
    exact = exact && result.change == 0;
    holds = holds && result.smallest >= sim::fracture::kMinFragmentTets && result.joints == 0;
    joints += result.joints;
    found += text("; ", name, ": ", result.splits, " splits, ", result.refused, " refused, ", result.pieces,
                  " pieces, smallest of ", result.smallest, " tets, ", result.joints, " hinges or ball joints");
  };
  add("lattice", unit_cube(effort.brief ? 5 : 8));
  if (const auto bunny = stored_mesh(effort.references / "S09_bunny_hung" / "L0.json"))
    add("bunny", *bunny);
  else
    found += effort.brief ? "; the bunny is left to the full run" : "; the bunny is not at hand";
  return judged(exact, holds, joints, text(tries, " tries", found, "; mass ", exact ? "exact" : "not exact"));
}

Outcome random_order(const Method& method, const Effort& effort) {
  const Pose to{Quat::Identity(), Vec3(0.08, 0.01, 0)};
  const auto hash = [&](std::uint64_t seed, int threads) {
    auto world = std::move(sim::World::create(bar(method, {8, 2, 2}, to, seed), {.threads = threads}).value());
    for (int k = 0; k < 40; ++k) world->step();
    return std::pair(world->state_hash(), world->fem(0).fragments);
  };
  const auto first = hash(1, 1);
  const bool same = first == hash(1, 1) && first == hash(1, 2);
  // Two halves of the other seeds: what one gives, the other must find usual.
  std::array<std::vector<int>, 2> pieces;
  const std::uint64_t seeds = effort.brief ? 6 : 20;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) pieces[seed % 2].push_back(hash(seed, 1).second);
  for (std::vector<int>& half : pieces) std::ranges::sort(half);
  const auto median = [](const std::vector<int>& half) { return half[half.size() / 2]; };
  const bool overlap = pieces[0].front() <= median(pieces[1]) && median(pieces[1]) <= pieces[0].back() &&
                       pieces[1].front() <= median(pieces[0]) && median(pieces[0]) <= pieces[1].back();
  const int fewest = std::min(pieces[0].front(), pieces[1].front()),
            most = std::max(pieces[0].back(), pieces[1].back());
  if (!same) return {Verdict::fails, 1, "the same seed gives other bits in a second run or with two threads"};
  return judged(true, overlap && most <= 2 * fewest + 4, static_cast<double>(most) / fewest,
                text("same seed, 1 and 2 threads: same bits; ", seeds, " seeds: ", fewest, " to ", most,
                     " pieces, medians of either half ", median(pieces[0]), " and ", median(pieces[1])));
}

FemMaterial plastic_material(const Method& method) {
  FemMaterial material = soft_material();
  material.yield = 0.01;
  material.creep = 0.9;
  material.raw_creep = method.raw;
  material.flow = method.flow;
  return material;
}

// The yardstick's S11: y = 0.02, c = 0.3 in 1/60 s, n = 0.2.
FemMaterial path_material(const Method& method) {
  FemMaterial material;
  material.yield = 0.02;
  material.creep = 0.3;
  material.max_plastic = 0.2;
  material.raw_creep = method.raw;
  material.flow = method.flow;
  return material;
}

// Largest |eps^P| along S11's paths, drawn out to |eps| = 3 n and back to -3 n in 240 steps.
double plastic_strain_of_paths(const Method& method) {
  const FemMaterial material = path_material(method);
  Mat3 shear = Mat3::Zero();
  shear(0, 1) = shear(1, 0) = 1;
  double largest = 0;
  for (const Mat3& path : {Mat3(Vec3(1, -0.3, -0.3).asDiagonal()), shear, Mat3(Mat3::Identity())}) {
    Mat3 plastic = Mat3::Zero();
    for (int k = 1; k <= 240; ++k) {
      const double part = k <= 80 ? k / 80.0 : 1 - (k - 80) / 80.0;
      sim::fem::flow(material.flow, 3 * material.max_plastic * part * path.normalized(), material.yield,
                     sim::fem::creep_per_step(material, kDt, 1.0 / 60), material.max_plastic, plastic);
      largest = std::max(largest, plastic.norm());
    }
  }
  return largest / material.max_plastic;
}

// F4: with a plastic strain that is not coaxial the inner forces have a moment. The largest of an element, over force
// times edge.
double ghost_moment(SoftTrial& trial) {
  sim::fem::Elements& elements = trial.scratch.system.elements;
  sim::fem::update_elements(trial.rest, trial.mesh.tets, trial.state.x, trial.state.plastic_strain, trial.pool,
                            elements);
  double largest = 0;
  const double* corner = elements.forces();
  const auto look = [&](std::span<const int> nodes) {
    Vec3 moment = Vec3::Zero();
    double force = 0;
    for (const int node : nodes) {
      const Eigen::Map<const Vec3> f(corner);
      moment += trial.state.x[node].cross(f);
      force += f.norm();
      corner += 3;
    }
    const double mean = force / static_cast<double>(nodes.size());
    if (force > 1e-3) largest = std::max(largest, moment.norm() / (mean * trial.rest.mean_edge));
  };
  const sim::fem::MacroElements& o = trial.rest.macros;
  for (int d = 0; d < o.count(); ++d)
    look({o.nodes.begin() + o.corner_start[d], o.nodes.begin() + o.corner_start[d + 1]});
  const sim::fem::PressurePatches& patches = trial.rest.patches;
  for (int p = 0; p < patches.count(); ++p)
    look({patches.nodes.begin() + patches.corner_start[p], patches.nodes.begin() + patches.corner_start[p + 1]});
  if (o.empty() || elements.macros.any_split)
    for (const Tet& tet : trial.mesh.tets) look(tet);
  return largest;
}

Outcome large_strain(const Method& method, const Effort& effort) {
  const FemMethod& fem = method.fem.step ? method.fem : methods_of(Family::fem).front()->fem;
  FemMaterial material = plastic_material(method);
  material.creep = 1;
  double largest = 0, volume = 0;
  bool sound = true;
  const auto measure = [&](const SoftTrial& trial) {
    sound = sound && trial.sound();
    for (const Mat3& strain : trial.state.plastic_strain) {
      largest = std::max(largest, strain.norm());
      volume = std::max(volume, std::abs((Mat3::Identity() + strain).determinant() - 1));
    }
  };
  SoftTrial scrambled(unit_cube(effort.brief ? 2 : 3), material, fem);
  Random random(1);
  scrambled.deform([&](const Vec3&) { return random.vec3(0, 1); });
  scrambled.run(2, kDt);
  measure(scrambled);

  // One end is turned by 720 degrees in two seconds, the other is held.
  SoftTrial twisted(block({1, 0.2, 0.2}, {10, 2, 2}), material, fem);
  for (int k = 0; k < 120; ++k) {
    twisted.prescribed.clear();
    const Mat3 R = Eigen::AngleAxisd(4 * std::numbers::pi * (k + 1) / 120, Vec3::UnitX()).toRotationMatrix();
    const Vec3 axis(1, 0.1, 0.1);
    for (int i = 0; i < twisted.mesh.node_count(); ++i) {
      if (twisted.mesh.X[i].x() == 0) twisted.prescribed.push_back({i, Vec3::Zero()});
      if (twisted.mesh.X[i].x() == 1)
        twisted.prescribed.push_back({i, (R * (twisted.mesh.X[i] - axis) + axis - twisted.state.x[i]) / kDt});
    }
    twisted.run(kDt, kDt);
  }
  measure(twisted);
  const double torque = ghost_moment(twisted);
  const double of_paths = plastic_strain_of_paths(method);
  return judged(sound, largest <= material.max_plastic * (1 + 1e-12) && of_paths <= 1 + 1e-12, largest,
                text("largest plastic strain ", largest, " of n = ", material.max_plastic, ", on S11's paths to 3 n ",
                     of_paths, " n, with it ", 100 * volume,
                     " % of an element's volume; after 720 degrees an element's ghost moment is up to ", torque,
                     " of force times edge, ", twisted.inverted(), " inverted"));
}

Outcome creep_rate(const Method& method, const Effort&) {
  const FemMaterial material = path_material(method);
  const Vec3 direction = Vec3(1, -0.3, -0.3).normalized();
  const auto update = [&](double strain, double dt, Mat3& plastic) {
    sim::fem::flow(material.flow, strain * Mat3(direction.asDiagonal()), material.yield,
                   sim::fem::creep_per_step(material, dt, 1.0 / 60), material.max_plastic, plastic);
  };
  // Held at 0.1 for a tenth of a second: |e_E| = y + (|e| - y)(1 - c)^(t / dt_ref) (FORMULAS F18), e the strain or its
  // deviator.
  const auto held = [&](double dt) {
    Mat3 plastic = Mat3::Zero();
    for (int k = 0; k < std::lround(0.1 / dt); ++k) update(0.1, dt, plastic);
    return plastic.norm();
  };
  // S11's ramp: 0.00174 a sixtieth of a second for one second.
  const auto drawn = [&](double dt) {
    Mat3 plastic = Mat3::Zero();
    const long steps = std::lround(1 / dt);
    for (long k = 1; k <= steps; ++k) update(0.1044 * static_cast<double>(k) / static_cast<double>(steps), dt, plastic);
    return plastic.norm();
  };
  const bool deviatoric = material.flow == sim::fem::FlowRule::deviatoric;
  const double yielding = 0.1 * (deviatoric ? (direction.array() - direction.mean()).matrix().norm() : 1);
  const double formula = (yielding - material.yield) * (1 - std::pow(1 - material.creep, 6));
  double worst = 0;
  std::string hold, ramp;
  for (const double rate : {30.0, 60.0, 120.0, 240.0}) {
    const double change = held(1 / rate) / formula - 1;
    worst = std::max(worst, std::abs(change));
    hold += text(" 1/", rate, ": ", 100 * change, " %;");
    if (rate < 60) continue;
    const double half = drawn(0.5 / rate) / drawn(1 / rate) - 1;
    worst = std::max(worst, std::abs(half));
    ramp += text(" 1/", rate, ": ", 100 * half, " %;");
  }
  return judged(true, worst < 0.01, worst,
                text("plastic flow of a strain held for 0.1 s against its formula at dt =", hold,
                     " of S11's ramp with half the step against the whole, at dt =", ramp));
}

}  // namespace

std::vector<Row> fracture_rows() {
  return {
      {23,
       "Fracture cascade, shatter in one step",
       "A bar pulled to 1.01 and 10 times its strength and twisted by 162 degrees, cap of 20 splits a step",
       "splits <= cap, pieces finite, energy does not rise after the end stopped",
       Family::fracture,
       cascade,
       1,
       {{"restressing", "refined steps while a crack runs"}}},
      {24, "Single-tet floaters, hinges, ball joints",
       "10,000 random node splits of a lattice of 3,072 tets and of the bunny (S09 L0)",
       "no piece under 3 tets, no link by an edge or a node, mass exact", Family::world, floaters, 6},
      {25, "Dependence on the random order", "A breaking bar: the same seed twice and with 2 threads, 20 seeds",
       "same seed same bits; the median number of pieces of either half of the seeds lies within the other's range",
       Family::fracture, random_order, 3},
      {26,
       "Additive plasticity at large strain",
       "S11's paths to 3 n; scrambled cube with c = 1; a yielded bar twisted by 720 degrees",
       "|eps^P| <= n, bounded; change of volume and ghost moment reported",
       Family::plasticity,
       large_strain,
       2,
       {{"multiplicative plasticity", "flow without a volume error at large strain"}}},
      {27, "Creep that depends on dt",
       "A strain of 0.1 held for 0.1 s at dt = 1/30 to 1/240; S11's ramp at dt and dt/2",
       "the flow of F18 and the same flow at dt/2, within 1 %", Family::plasticity, creep_rate, 0.1},
  };
}

}  // namespace crumple::lab::stability
