#include "common/text.h"
#include "server/authoring/car_asset.h"
#include "server/authoring/shapes/surfaces.h"
#include "server/lab/stability/row.h"
#include "server/lab/stability/soft_trial.h"
#include "server/sim/rigid/collision_triangles.h"
#include "server/sim/rigid/rigid_world.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cmath>

// Rows about collision shapes and about bodies whose inertia changes.
namespace crumple::lab::stability {
namespace {

using sim::ConvexHull;
using sim::DeformableShape;
using sim::MassProperties;
using sim::RigidWorld;
using sim::SurfaceMesh;

sim::RigidModel fixed(const sim::Shape& shape) {
  sim::RigidModel model{.kind = sim::RigidKind::fixed, .friction = 0, .restitution = 0};
  model.shapes.push_back({Pose{}, shape});
  return model;
}

DeformableShape shape_of(const Method& method, const SurfaceMesh& mesh) {
  if (method.triangles) return mesh;
  return std::vector<ConvexHull>{{mesh.vertices}};
}

// A square floor of n x n cells of two triangles, on y = 0.
SurfaceMesh floor_mesh(int n, double size) {
  SurfaceMesh mesh;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      mesh.vertices.push_back(
          {size * (static_cast<double>(i) / n - 0.5), 0, size * (static_cast<double>(j) / n - 0.5)});
  const auto id = [&](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      mesh.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j)});
      mesh.triangles.push_back({id(i + 1, j), id(i, j + 1), id(i + 1, j + 1)});
    }
  return mesh;
}

Outcome degenerate_triangles(const Method& method, const Effort&) {
  // A box with two flat, a needle, a repeated-vertex and a doubled triangle, dropped on a floor that has them, too.
  constexpr std::size_t kSpoiled = 5;
  const auto spoil = [](SurfaceMesh mesh) {
    const Triangle t = mesh.triangles[0];
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const int n = static_cast<int>(mesh.vertices.size());
    const Vec3 across = (c - a).normalized() * (b - a).norm();
    mesh.vertices.insert(mesh.vertices.end(), {0.5 * (a + b), a + 1e-9 * (b - a), 0.5 * (a + b) + 0.9e-6 * across});
    mesh.triangles.push_back({t[0], t[1], n});
    mesh.triangles.push_back({t[0], n + 1, t[1]});
    mesh.triangles.push_back({t[0], t[1], n + 2});
    mesh.triangles.push_back({t[0], t[0], t[1]});
    mesh.triangles.push_back(t);
    return mesh;
  };
  const SurfaceMesh floor = floor_mesh(4, 4), box = authoring::box_surface(Vec3::Constant(0.25));
  const std::size_t kept = sim::sound_triangles(spoil(floor)).size();
  RigidWorld world;
  const auto ground = world.add_body(0, fixed(sim::TriangleShape{spoil(floor)}), {});
  const auto body = world.add_deformable(1, shape_of(method, spoil(box)), with_mass(sim::closed_mesh_mass(box, 1), 10),
                                         0.5, 0, {Quat::Identity(), Vec3(0.1, 0.6, 0.13)});
  if (!ground || !body)
    return {Verdict::fails, 1, "degenerate triangles are not taken: " + (ground ? body : ground).error().text()};
  for (int k = 0; k < 480; ++k) world.step(1.0 / 240);
  // The same after a deformation: an upper corner comes to lie on its neighbour, but for a ten-millionth of the edge.
  SurfaceMesh dented = spoil(box);
  const auto upper = [&](int v) { return dented.vertices[v].y() > 0; };
  int moved = 0, onto = 1;
  while (!upper(moved)) ++moved;
  while (onto == moved || !upper(onto) || (dented.vertices[onto] - dented.vertices[moved]).norm() > 0.6) ++onto;
  dented.vertices[moved] = dented.vertices[onto] + 1e-7 * (dented.vertices[moved] - dented.vertices[onto]);
  const auto changed =
      world.set_shape_and_mass(1, shape_of(method, dented), with_mass(sim::closed_mesh_mass(box, 1), 10));
  if (!changed) return {Verdict::fails, 1, "a shape with needles is not taken: " + changed.error().text()};
  for (int k = 0; k < 240; ++k) world.step(1.0 / 240);
  const Vec3 p = world.com(1);
  return judged(p.allFinite() && world.is_moving(1), kept == floor.triangles.size() && std::abs(p.y() - 0.25) < 0.02,
                std::abs(p.y() - 0.25),
                text(kept, " of ", floor.triangles.size() + kSpoiled, " triangles of the floor are kept (",
                     floor.triangles.size(), " are sound); the box, dented to needles, rests ",
                     1000 * std::abs(p.y() - 0.25), " mm from where it should"));
}

// Three boxes in the form of a U, open towards +y, as one surface or three parts.
std::vector<SurfaceMesh> u_parts() {
  const auto at = [](const Vec3& half, const Vec3& p) {
    SurfaceMesh mesh = authoring::box_surface(half);
    for (Vec3& v : mesh.vertices) v += p;
    return mesh;
  };
  return {at({1, 0.2, 0.5}, {0, -0.8, 0}), at({0.2, 0.8, 0.5}, {-0.8, 0.2, 0}), at({0.2, 0.8, 0.5}, {0.8, 0.2, 0})};
}

double entangled(const Method& method, double dt, bool& sound, double& overlap) {
  const std::vector<SurfaceMesh> parts = u_parts();
  DeformableShape shape;
  std::vector<MassProperties> masses;
  SurfaceMesh whole;
  std::vector<ConvexHull> hulls;
  for (const SurfaceMesh& part : parts) {
    masses.push_back(sim::closed_mesh_mass(part, 100));
    hulls.push_back({part.vertices});
    authoring::append(whole, part);
  }
  if (method.triangles)
    shape = whole;
  else
    shape = hulls;
  const MassProperties mass = sim::combined(masses);
  RigidWorld world;
  (void)world.add_body(0, fixed(sim::Plane{}), {});
  // The second hangs upside down, one arm in the first's mouth, and falls into it at 5 m/s.
  (void)world.add_deformable(1, shape, mass, 0.5, 0.1, {Quat::Identity(), Vec3(0, 1.01, 0)});
  const Quat over(Eigen::AngleAxisd(M_PI, Vec3::UnitZ()));
  (void)world.add_deformable(2, shape, mass, 0.5, 0.1,
                             {over * Quat(Eigen::AngleAxisd(0.15, Vec3::UnitY())), Vec3(0.75, 2.1, 0.05)},
                             Vec3(0, -5, 0));
  double fastest = 0;
  overlap = 0;
  for (int k = 0; k < std::lround(3 / dt); ++k) {
    const auto report = world.step(dt);
    sound = sound && report.frozen.empty();
    if (k * dt > 2) overlap = std::max(overlap, report.worst_penetration);
    for (const BodyId body : {1u, 2u}) fastest = std::max(fastest, world.velocity(body).norm());
  }
  return fastest;
}

// Two cars crosswise, the upper one's wheels a quarter of a metre deep in the lower one's cabin, from rest.
struct Interlocked {
  bool sound = true;
  double fastest = 0, overlap = 0;  // overlap: of the last second [m]
};

Result<Interlocked> cars(const Method& method, double dt) {
  auto made = authoring::make_car_asset();
  if (!made) return std::unexpected(made.error());
  sim::ExampleModel model{.set = std::make_shared<sim::example_based::ExampleSet>(std::move(*made)), .mass = 1000};
  model.parameters.beta = 1e9;  // does not dent: the row is about the shape
  model.parameters.triangle_collision = method.triangles;
  sim::SceneDescription scene{.name = "cars", .dt = dt};
  scene.unguarded = true;
  sim::RigidModel ground{.kind = sim::RigidKind::fixed};
  ground.shapes.push_back({Pose{}, sim::Plane{}});
  scene.bodies.push_back({.name = "ground", .model = ground});
  scene.bodies.push_back({.name = "lower", .model = model});
  scene.bodies.push_back({.name = "upper", .model = model});
  scene.bodies.back().pose = {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY())), Vec3(0, 1.15, 0)};
  auto world = sim::World::create(scene);
  if (!world) return std::unexpected(world.error());
  Interlocked result;
  for (int k = 0; k < std::lround(3 / dt); ++k) {
    const sim::StepReport report = (*world)->step();
    for (const sim::Event& event : (*world)->take_events())
      result.sound = result.sound && event.kind != sim::EventKind::frozen;
    for (const BodyId body : {1u, 2u}) result.fastest = std::max(result.fastest, (*world)->velocity(body).norm());
    if ((*world)->time() > 2) result.overlap = std::max(result.overlap, report.worst_penetration);
  }
  for (const BodyId body : {1u, 2u}) result.sound = result.sound && (*world)->pose(body).p_WB.allFinite();
  return result;
}

Outcome concave(const Method& method, const Effort& effort) {
  bool sound = true;
  double overlap_60 = 0, overlap_240 = 0;
  double at_60 = entangled(method, 1.0 / 60, sound, overlap_60),
         at_240 = entangled(method, 1.0 / 240, sound, overlap_240);
  std::string found =
      text("U's: fastest ", at_60, " m/s at dt = 1/60 and ", at_240, " at 1/240 (impact at 5); overlap left ",
           1000 * overlap_60, " and ", 1000 * overlap_240, " mm");
  if (!effort.brief) {
    const auto slow = cars(method, 1.0 / 60), fine = cars(method, 1.0 / 240);
    if (!slow || !fine) return {Verdict::fails, 1, (slow ? fine : slow).error().text()};
    sound = sound && slow->sound && fine->sound;
    found += text("; cars: fastest ", slow->fastest, " and ", fine->fastest, " m/s, overlap left ",
                  1000 * slow->overlap, " and ", 1000 * fine->overlap, " mm");
    at_60 = std::max(at_60, slow->fastest);
    at_240 = std::max(at_240, fine->fastest);
    overlap_240 = std::max(overlap_240, fine->overlap);
  }
  return judged(sound, at_240 < 10 && overlap_240 < 0.02 && at_60 < 10, std::max(at_60, at_240), found);
}

Outcome internal_edges(const Method& method, const Effort&) {
  RigidWorld world;
  (void)world.add_body(0, fixed(sim::TriangleShape{floor_mesh(40, 20)}), {});
  const SurfaceMesh box = authoring::box_surface({0.3, 0.2, 0.3});
  (void)world.add_deformable(1, shape_of(method, box), with_mass(sim::closed_mesh_mass(box, 1), 10), 0, 0,
                             {Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY())), Vec3(-8, 0.2, 0.1)});
  for (int k = 0; k < 120; ++k) world.step(1.0 / 120);
  world.set_velocity(1, Vec3(5, 0, 0.7), Vec3::Zero());
  double kick = 0, turn = 0;
  for (int k = 0; k < 240; ++k) {
    world.step(1.0 / 120);
    kick = std::max(kick, std::abs(world.velocity(1).y()));
    turn = std::max(turn, world.angular_velocity(1).norm());
  }
  const double speed = std::hypot(5, 0.7);
  return judged(world.com(1).allFinite(), kick < 0.01 * speed, kick / speed,
                text("vertical kick ", 100 * kick / speed, " % of the speed, turning ", turn, " rad/s, speed kept ",
                     100 * world.velocity(1).norm() / speed, " %"));
}

Outcome changing_inertia(const Method& method, const Effort&) {
  SurfaceMesh box = authoring::box_surface({0.5, 0.4, 0.3});
  RigidWorld world({.gravity = Vec3::Zero()});
  (void)world.add_deformable(1, shape_of(method, box), with_mass(sim::closed_mesh_mass(box, 1), 20), 0.5, 0, {},
                             {1, 2, 3}, {4, 5, 6});
  const Vec3 L = world.angular_momentum(1);
  double moved = 0, drift = 0;
  for (int k = 0; k < 200; ++k) {
    box.vertices[k % 8] *= 0.97;
    const Pose before = world.pose(1);
    (void)world.set_shape_and_mass(1, shape_of(method, box), with_mass(sim::closed_mesh_mass(box, 1), 20));
    for (const Vec3& v : box.vertices) moved = std::max(moved, (world.pose(1) * v - before * v).norm());
    world.step(1.0 / 120);
    drift = std::max(drift, (world.angular_momentum(1) - L).norm() / L.norm());
  }
  // To a plate, as point masses: a triangle mesh without volume has no mass of its own.
  for (Vec3& v : box.vertices) v.x() = 0;
  const std::vector<double> masses(8, 2.5);
  (void)world.set_shape_and_mass(1, shape_of(method, box), sim::point_mass(box.vertices, masses));
  bool sound = true;
  for (int k = 0; k < 120; ++k) sound = world.step(1.0 / 120).frozen.empty() && sound;
  drift = std::max(drift, (world.angular_momentum(1) - L).norm() / L.norm());
  const Mat3 I = world.inertia(1);
  sound = sound && I.llt().info() == Eigen::Success;
  return judged(sound, drift < 1e-6 && moved < 1e-6, std::max(drift, moved),
                text("200 dents: L drifts by ", drift, " of itself, world points move by ", moved,
                     " m; flattened to a plate I stays positive definite"));
}

}  // namespace

std::vector<Row> rigid_rows() {
  return {
      {35, "Degenerate collision triangles",
       "Floor and box with two flat, a needle (1e6 : 0.9), a repeated-vertex and a doubled triangle; then a corner of "
       "the "
       "box moved onto its neighbour",
       "dropped before the tree; the box rests where it should", Family::shape, degenerate_triangles, 0.5},
      {36, "Dynamic concave triangle meshes",
       "Two U-shaped bodies, one falls into the other at 5 m/s; two cars that start a quarter of a metre in each "
       "other; dt = "
       "1/60 and 1/240 s",
       "nothing faster than 10 m/s, overlap < 2 cm at 1/240", Family::shape, concave, 10},
      {37, "Bumps on internal edges", "A box slides at 5 m/s over a floor of 3,200 triangles",
       "vertical kick < 1 % of the speed", Family::shape, internal_edges, 0.5},
      {38, "Changing inertia", "A spinning box dented in each of 200 steps, then flattened to a plate",
       "L kept to 1e-6, I positive definite, world points unmoved", Family::shape, changing_inertia, 0.2},
  };
}

}  // namespace crumple::lab::stability
