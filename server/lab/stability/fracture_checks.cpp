#include "common/text.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/fem/plasticity.h"
#include "server/sim/fracture/fragments.h"
#include "server/sim/fracture/mesh_split.h"
#include "server/sim/world.h"

#include <Eigen/LU>

#include <algorithm>
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
  scene.unguarded = true;
  const Vec3 size = kEdge * Vec3(cells[0], cells[1], cells[2]);
  sim::TetMesh mesh = block(size, cells);
  for (Vec3& X : mesh.X) X -= Vec3(0, size.y() / 2, size.z() / 2);  // turns about its axis
  sim::FemModel model;
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
  int splits = 0, most_in_a_step = 0, fragments = 1;
  double gain = 0;  // largest energy after the end stopped, over that when it stopped, minus 1
};

Broken pull(const sim::SceneDescription& scene, double seconds) {
  auto world = std::move(sim::World::create(scene).value());
  Broken result;
  double stopped = 0, largest = 0;
  for (int k = 0; k < std::lround(seconds / kDt); ++k) {
    const sim::StepReport report = world->step();
    result.splits += report.splits;
    result.most_in_a_step = std::max(result.most_in_a_step, report.splits);
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
  return result;
}

Outcome cascade(const Method& method, const Effort& effort) {
  const std::array<int, 3> cells{8, 2, 2};
  Broken worst;
  std::string found;
  // 1.01 and 10 times the stress that parts the bar: E eps = s.
  for (const double factor : {1.01, 10.0}) {
    const Broken result =
        pull(bar(method, cells, {Quat::Identity(), Vec3(8 * kEdge * factor * kStrength / 1e6, 0, 0)}, 1),
             effort.brief ? 1 : 3);
    found += text(" pulled to ", factor, " s_c: ", result.splits, " splits (", result.most_in_a_step, " in a step), ",
                  result.fragments, " pieces;");
    worst.sound = worst.sound && result.sound;
    worst.most_in_a_step = std::max(worst.most_in_a_step, result.most_in_a_step);
    worst.gain = std::max(worst.gain, result.gain);
  }
  const Pose turned{Quat(Eigen::AngleAxisd(0.9 * std::numbers::pi, Vec3::UnitX())), Vec3::Zero()};
  const Broken twist = pull(bar(method, cells, turned, 1), effort.brief ? 1 : 3);
  found += text(" twisted: ", twist.splits, " splits, ", twist.fragments, " pieces;");
  worst.sound = worst.sound && twist.sound;
  worst.most_in_a_step = std::max(worst.most_in_a_step, twist.most_in_a_step);
  worst.gain = std::max(worst.gain, twist.gain);
  return judged(
      worst.sound, worst.most_in_a_step <= kMaxSplits && worst.gain < 0.01, worst.gain,
      text("cap ", kMaxSplits, " a step:", found, " energy rises by ", 100 * worst.gain, " % after the end stopped"));
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

Outcome floaters(const Method&, const Effort& effort) {
  sim::TetMesh mesh = unit_cube(effort.brief ? 5 : 8);
  sim::fem::FemState state{mesh.X, std::vector<Vec3>(mesh.X.size(), Vec3::Zero()), {}};
  sim::NodeStars stars(mesh.tets, mesh.node_count());
  std::vector<double> volume;
  for (int t = 0; t < mesh.tet_count(); ++t) volume.push_back(sim::signed_volume(mesh, t));
  Random random(11);
  int splits = 0, refused = 0;
  const int tries = effort.brief ? 2000 : 10000;
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
    splits += static_cast<int>(report.splits.size());
    refused += report.refused;
  }
  const auto fragments = sim::fracture::find_fragments(mesh.tets);
  int joints = 0;
  for (int n = 0; n < stars.node_count(); ++n) joints += groups_at(mesh.tets, stars[n]) > 1;
  double change = 0;
  for (int t = 0; t < mesh.tet_count(); ++t)
    change = std::max(change, std::abs(sim::signed_volume(mesh, t) - volume[t]));
  const int smallest = std::ranges::min(fragments.size);
  return judged(change == 0, smallest >= sim::fracture::kMinFragmentTets && joints == 0, joints,
                text(tries, " tries: ", splits, " splits, ", refused, " refused, ", fragments.count(),
                     " pieces, smallest of ", smallest, " tets, ", joints, " hinges or ball joints; mass exact"));
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
  int fewest = first.second, most = first.second;
  for (std::uint64_t seed = 2; seed <= (effort.brief ? 3u : 12u); ++seed) {
    const int pieces = hash(seed, 1).second;
    fewest = std::min(fewest, pieces);
    most = std::max(most, pieces);
  }
  if (!same) return {Verdict::fails, 1, "the same seed gives other bits in a second run or with two threads"};
  return judged(true, most <= 2 * fewest + 4, static_cast<double>(most) / fewest,
                text("same seed, 1 and 2 threads: same bits; other seeds: ", fewest, " to ", most, " pieces"));
}

FemMaterial plastic_material(const Method& method) {
  FemMaterial material = soft_material();
  material.yield = 0.01;
  material.creep = 0.9;
  material.raw_creep = method.raw;
  return material;
}

Outcome large_strain(const Method& method, const Effort& effort) {
  const FemMethod& fem = methods_of(Family::fem).front()->fem;
  FemMaterial material = plastic_material(method);
  material.creep = 1;
  double largest = 0, torque = 0;
  bool sound = true;
  const auto measure = [&](const SoftTrial& trial) {
    sound = sound && trial.sound();
    for (const Mat3& strain : trial.state.plastic_strain) largest = std::max(largest, strain.norm());
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
  // F4: with a plastic strain that is not coaxial the inner forces have a moment.
  Eigen::VectorXd f(3 * twisted.mesh.node_count());
  sim::fem::elastic_forces(twisted.rest, twisted.mesh.tets, twisted.state.x, twisted.state.plastic_strain, twisted.pool,
                           twisted.scratch.system.elements, f);
  for (int t = 0; t < twisted.mesh.tet_count(); ++t) {
    Vec3 moment = Vec3::Zero();
    double force = 0;
    for (int a = 0; a < 4; ++a) {
      moment += twisted.state.x[twisted.mesh.tets[t][a]].cross(twisted.scratch.system.elements.force[t].col(a));
      force += twisted.scratch.system.elements.force[t].col(a).norm();
    }
    if (force > 1e-3) torque = std::max(torque, moment.norm() / (force / 4 * twisted.rest.mean_edge));
  }
  return judged(sound, largest <= material.max_plastic * (1 + 1e-12), largest,
                text("largest plastic strain ", largest, " of n = ", material.max_plastic,
                     "; after 720 degrees an element's ghost moment is up to ", torque, " of force times edge, ",
                     twisted.inverted(), " inverted"));
}

Outcome creep_rate(const Method& method, const Effort&) {
  FemMaterial material = plastic_material(method);
  material.creep = 0.3;
  material.max_plastic = 10;
  // Held at a strain, then let flow for a tenth of a second.
  const auto flowed = [&](double dt) {
    Mat3 plastic = Mat3::Zero(), total = Mat3::Zero();
    total.diagonal() = Vec3(0.1, -0.04, -0.02);
    for (int k = 0; k < std::lround(0.1 / dt); ++k)
      sim::fem::flow(total, material.yield, sim::fem::creep_per_step(material, dt, 1.0 / 60), material.max_plastic,
                     plastic);
    return plastic.norm();
  };
  const double at_60 = flowed(1.0 / 60);
  double worst = 0;
  std::string found;
  for (const double rate : {30.0, 120.0, 240.0}) {
    const double change = flowed(1 / rate) / at_60 - 1;
    worst = std::max(worst, std::abs(change));
    found += text(" 1/", rate, ": ", 100 * change, " %;");
  }
  return judged(true, worst < 0.01, worst, text("plastic flow of 0.1 s against that at dt = 1/60:", found));
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
      {24, "Single-tet floaters, hinges, ball joints", "10,000 random node splits of a lattice of 3,072 tets",
       "no piece under 3 tets, no link by an edge or a node, mass exact", Family::world, floaters, 3},
      {25, "Dependence on the random order", "A breaking bar: the same seed twice and with 2 threads, other seeds",
       "same seed same bits; other seeds overlap in their statistics", Family::fracture, random_order, 2},
      {26,
       "Additive plasticity at large strain",
       "Scrambled cube with c = 1; a yielded bar twisted by 720 degrees",
       "|eps^P| <= n, bounded; ghost moment reported",
       Family::plasticity,
       large_strain,
       2,
       {{"multiplicative plasticity", "flow without a volume error at large strain"}}},
      {27, "Creep that depends on dt", "A strain of 0.1 held for 0.1 s at dt = 1/30 to 1/240",
       "the same flow within 1 %", Family::plasticity, creep_rate, 0.1},
  };
}

}  // namespace crumple::lab::stability
