#include "common/text.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/limits.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

// Rows about what a world lets in. What needs sockets lives in tests/grpc.
namespace crumple::lab::stability {
namespace {

using namespace sim;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Two soft blocks far from each other and a rigid one.
SceneDescription two_worlds_in_one() {
  ContactTrial trial({});
  trial.add_ground();
  trial.add_block({.centre = {0, 0.6, 0}});
  trial.add_block({.centre = {50, 0.6, 0}});
  SceneDescription scene = trial.scene;
  RigidModel model;
  model.shapes.push_back({Pose{}, Box{}});
  scene.bodies.push_back({.name = "rigid", .pose = {Quat::Identity(), Vec3(100, 0.6, 0)}, .model = model});
  return scene;
}

Outcome injection(const Method&, const Effort&) {
  const std::vector<double> bad{kNan, kInfinity, -kInfinity, 1e30};
  auto touched = std::move(World::create(two_worlds_in_one()).value()),
       control = std::move(World::create(two_worlds_in_one()).value());
  int refused = 0, tried = 0;
  const auto reject = [&](const Result<void>& result) {
    ++tried;
    refused += !result;
  };
  for (int k = 0; k < 60; ++k) {
    for (const double value : bad) {
      const Vec3 v(0, value, 0);
      reject(touched->submit(ApplyImpulse{.body = 1, .impulse = v}));
      reject(touched->submit(ApplyImpulse{.body = 3, .impulse = v}));
      reject(touched->submit(ApplyImpulse{.body = 1, .impulse = {0, 1, 0}, .point = v}));
      reject(touched->submit(ApplyForce{.body = 1, .force = v}));
      reject(touched->submit(ApplyNodeImpulse{1, {0}, v}));
    }
    reject(touched->submit(ApplyNodeImpulse{1, {1 << 30}, {0, 1, 0}}));
    reject(touched->submit(ApplyImpulse{.body = 1u << 31, .impulse = {0, 1, 0}}));
    touched->step();
    control->step();
  }
  const bool untouched = touched->state_hash() == control->state_hash();

  // The same through a scene.
  const auto spoiled = [&](const std::function<void(SceneDescription&)>& spoil) {
    SceneDescription scene = two_worlds_in_one();
    spoil(scene);
    reject(sim::validate(scene));
  };
  for (const double value : bad) {
    spoiled([&](SceneDescription& s) { s.bodies[1].pose.p_WB.x() = value; });
    spoiled([&](SceneDescription& s) { s.bodies[1].velocity.x() = value; });
    spoiled([&](SceneDescription& s) { std::get<FemModel>(s.bodies[1].model).material.young = value; });
    spoiled([&](SceneDescription& s) { std::get<FemModel>(s.bodies[1].model).material.density = value; });
    spoiled([&](SceneDescription& s) { std::get<RigidModel>(s.bodies[3].model).mass = value; });
    spoiled([&](SceneDescription& s) { s.gravity.z() = value; });
    spoiled([&](SceneDescription& s) { s.dt = value; });
    spoiled([&](SceneDescription& s) {
      auto& model = std::get<FemModel>(s.bodies[1].model);
      TetMesh mesh = *model.mesh;
      mesh.X[3].y() = value == 1e30 ? kNan : value;
      model.mesh = std::make_shared<TetMesh>(mesh);
    });
  }

  // The largest that the gate lets in, and denormals: body 1 may fare as it does, the others keep their bits.
  const double denormal = std::numeric_limits<double>::denorm_min();
  (void)touched->submit(ApplyImpulse{.body = 1, .impulse = {0, kMaxImpulse, 0}, .point = {0, 0.6, 0}, .radius = 100});
  (void)touched->submit(ApplyImpulse{.body = 1, .impulse = {denormal, 0, 0}});
  bool others = true;
  for (int k = 0; k < 60; ++k) {
    touched->step();
    control->step();
    const FemView a = touched->fem(2), b = control->fem(2);
    others = others && std::ranges::equal(a.x, b.x) && touched->pose(3).p_WB == control->pose(3).p_WB;
  }
  bool finite = true;
  for (const Vec3& x : touched->fem(1).x) finite = finite && x.allFinite();
  const std::string found = text(refused, " of ", tried, " bad values refused; ",
                                 untouched ? "the world is bit-identical to one without them" : "the world changed",
                                 "; after ", kMaxImpulse, " N s on one block it is ", finite ? "finite" : "not finite",
                                 " and the others ", others ? "keep their bits" : "changed");
  return judged(finite, refused == tried && untouched && others, tried - refused, found);
}

constexpr double kGrowth = 16;  // of a world that is flooded at an even rate [MiB]

// Memory of this process [MiB].
double resident_mib() {
  std::ifstream in("/proc/self/statm");
  double total = 0, resident = 0;
  in >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

Outcome limits(const Method&, const Effort& effort) {
  // Beyond the limits.
  const bool huge = !authoring::box_mesh({Vec3::Ones(), {200, 200, 200}, authoring::Lattice::kuhn, Vec3::Zero()});
  TetMesh many = block(Vec3::Ones(), {2, 2, 2});
  many.tets.resize(static_cast<std::size_t>(kMaxTets) + 1, many.tets.front());
  const bool refused = !validate(many, "mesh");
  std::string found = text("a lattice of 48 million tets is ", huge ? "refused" : "taken",
                           ", a mesh of kMaxTets + 1 is ", refused ? "refused" : "taken");

  SceneDescription crowd = two_worlds_in_one();
  const BodyDescription one = crowd.bodies.back();
  for (int k = 0; k <= sim::limits::kMaxBodies; ++k) {
    crowd.bodies.push_back(one);
    crowd.bodies.back().name = text("copy ", k);
  }
  const bool crowd_refused = !validate(crowd);
  found += text(", ", crowd.bodies.size(), " bodies are ", crowd_refused ? "refused" : "taken");

  // Another world that is flooded: 20,000 commands a step.
  auto quiet = std::move(World::create(two_worlds_in_one()).value()),
       alone = std::move(World::create(two_worlds_in_one()).value());
  auto flooded = std::move(World::create(two_worlds_in_one()).value());
  bool finite = true;
  double before = 0;
  for (int k = 0; k < (effort.brief ? 5 : 30); ++k) {
    if (k == 5) before = resident_mib();
    for (int n = 0; n < 20'000; ++n)
      (void)flooded->submit(ApplyImpulse{.body = 1, .impulse = {0.01, 0, 0}, .point = {0, 0.6, 0}});
    flooded->step();
    quiet->step();
  }
  // Memory is not judged in the regression part: sanitizers keep what is freed.
  const double growth = effort.brief ? 0 : resident_mib() - before;
  for (int k = 0; k < (effort.brief ? 5 : 30); ++k) alone->step();
  for (const Vec3& x : flooded->fem(1).x) finite = finite && x.allFinite();
  const bool same = quiet->state_hash() == alone->state_hash();
  found += text("; beside a world that takes 20,000 commands a step another is ",
                same ? "bit-identical to one alone" : "different");
  if (!effort.brief) found += text(", and 25 such steps take ", growth, " MiB more than the first five");
  const bool bounded = growth < kGrowth;
  return judged(finite, huge && refused && crowd_refused && same && bounded,
                !huge + !refused + !crowd_refused + !same + !bounded,
                found + ". Floods of clients, broken frames and disconnects in mid-step: tests/grpc, tests/runtime");
}

}  // namespace

std::vector<Row> server_rows() {
  return {
      {17, "NaN, infinite or huge input",
       "NaN, +-infinity, 1e30, denormals and ids out of range in impulses, forces, points, poses, materials, meshes",
       "refused with an error; other bodies bit-identical", Family::world, injection, 2},
      {41, "Client flood, huge mesh, 1e6 tets, disconnect",
       "Meshes and scenes beyond the limits, a world flooded with commands beside a quiet one",
       "refused; the other world bit-identical; memory bounded", Family::world, limits, 4},
  };
}

}  // namespace crumple::lab::stability
