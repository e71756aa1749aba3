#pragma once

#include "server/sim/contact/detect.h"
#include "server/sim/fem/implicit_euler.h"
#include "server/sim/islands/composite_island.h"
#include "tests/support/kuhn_lattice.h"

#include <deque>
#include <memory>
#include <optional>

namespace crumple::sim::islands {

// A lattice of cells of edge H, stretched to `size`, its lowest corner at the origin.
inline TetMesh block_mesh(std::array<int, 3> cells, const Vec3& size) {
  TetMesh mesh = test::kuhn_lattice(cells, 1);
  for (Vec3& X : mesh.X) X = X.cwiseProduct(size).cwiseQuotient(Vec3(cells[0], cells[1], cells[2]));
  return mesh;
}

struct SoftBody {
  TetMesh mesh;
  fem::RestBody rest;
  fem::FemState state;
  contact::CollisionMesh collision;
  std::optional<contact::SelfContact> self;
  fem::StepSystem system;
  std::vector<fem::PrescribedNode> prescribed;
  linear_solver::MultigridHierarchy hierarchy;
  fem::WarpedFactor factor;

  void meet_itself() { self = contact::make_self_contact(collision, mesh.X); }
  Vec3 momentum() const {
    Vec3 p = Vec3::Zero();
    for (std::size_t i = 0; i < state.v.size(); ++i) p += rest.node_mass[i] * state.v[i];
    return p;
  }
  double mass() const { return rest.mass(); }
  Vec3 velocity() const { return momentum() / mass(); }
  Vec3 centre() const {
    Vec3 c = Vec3::Zero();
    for (std::size_t i = 0; i < state.x.size(); ++i) c += rest.node_mass[i] * state.x[i];
    return c / mass();
  }
  double rms_speed() const {
    double sum = 0;
    for (const Vec3& v : state.v) sum += v.squaredNorm();
    return std::sqrt(sum / state.v.size());
  }
};

// A box that moves rigidly, integrated here by the impulses that the island hands out.
struct RigidBox {
  TetMesh mesh;  // about its centre
  contact::CollisionMesh collision;
  std::vector<Vec3> x;
  Vec3 p = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
  Quat R = Quat::Identity();
  double mass = 0;
  Mat3 inertia = Mat3::Identity();
  bool movable = true;

  Mat3 inertia_W() const { return R.toRotationMatrix() * inertia * R.toRotationMatrix().transpose(); }
  void place() {
    x.resize(mesh.X.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = p + R * mesh.X[i];
  }
};

// A small world of soft bodies, rigid boxes and planes, stepped in the order of World::step.
struct SoftScene {
  Vec3 gravity{0, -9.81, 0};
  double dt = 1.0 / 60;
  ContactSettings settings;
  double friction = 0.5;
  linear_solver::SolveOptions solve{1e-5, 2000};
  linear_solver::SolverKind solver = linear_solver::SolverKind::jacobi;
  int passes = 2;
  std::deque<SoftBody> soft;
  std::deque<RigidBox> rigid;
  std::vector<contact::CollisionPlane> planes;
  contact::FrictionMemory memory;
  std::unique_ptr<ThreadPool> pool = std::make_unique<ThreadPool>(1);

  // Of the last step.
  std::vector<contact::ContactRow> rows;
  std::vector<CompositeIsland> islands;
  std::vector<IslandSolution> solutions;
  std::shared_ptr<SolveMemories> memories = std::make_shared<SolveMemories>();

  SoftBody& add_soft(std::array<int, 3> cells, const Vec3& size, const Vec3& at, const Vec3& velocity = Vec3::Zero(),
                     double young = 1e6) {
    fem::FemMaterial material;
    material.young = young;
    return add_mesh(block_mesh(cells, size), material, at, velocity);
  }

  SoftBody& add_mesh(TetMesh mesh, const fem::FemMaterial& material, const Vec3& at, const Vec3& velocity = Vec3::Zero()) {
    SoftBody& body = soft.emplace_back();
    body.mesh = std::move(mesh);
    body.rest = fem::make_rest_body(body.mesh, material).value();
    for (const Vec3& X : body.mesh.X) body.state.x.push_back(X + at);
    body.state.v.assign(body.mesh.X.size(), velocity);
    body.state.plastic_strain.assign(body.mesh.tets.size(), Mat3::Zero());
    std::vector<double> tet_mass;
    for (int t = 0; t < body.mesh.tet_count(); ++t) tet_mass.push_back(material.density * body.rest.volume[t]);
    body.collision = contact::make_collision_mesh(body.mesh.tets, body.mesh.X, tet_mass);
    return body;
  }

  RigidBox& add_rigid(const Vec3& size, const Vec3& centre, double mass, bool movable) {
    RigidBox& box = rigid.emplace_back();
    box.mesh = block_mesh({1, 1, 1}, size);
    for (Vec3& X : box.mesh.X) X -= 0.5 * size;
    box.collision = contact::make_collision_mesh(box.mesh.tets, box.mesh.X, {});
    box.p = centre;
    box.mass = mass;
    box.movable = movable;
    const Vec3 s = size.cwiseProduct(size);
    box.inertia = Vec3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()).asDiagonal() * Mat3(mass / 12 * Mat3::Identity());
    return box;
  }

  void add_plane(const Vec3& normal, double offset) { planes.push_back({normal, offset, friction}); }

  void detect() {
    std::vector<contact::CollisionBody> bodies;
    for (SoftBody& body : soft)
      bodies.push_back({.mesh = &body.collision, .x = body.state.x, .v = body.state.v, .fixed = body.system.prescribed,
                        .friction = friction, .self = body.self ? &*body.self : nullptr});
    for (RigidBox& box : rigid) {
      box.place();
      const contact::RigidMotion motion{box.p, box.v, box.w, box.mass, box.movable};
      bodies.push_back({&box.collision, box.x, {}, {}, motion, friction});
    }
    rows = contact::detect({bodies, planes, gravity, dt, settings}, *pool);
  }

  std::vector<IslandBody> assemble() {
    std::vector<IslandBody> bodies;
    for (SoftBody& body : soft) {
      Eigen::VectorXd f(3 * body.state.x.size());
      for (std::size_t i = 0; i < body.state.x.size(); ++i) f.segment<3>(3 * i) = body.rest.node_mass[i] * gravity;
      fem::assemble(body.rest, body.mesh.tets, body.state, f, dt, body.prescribed, *pool, body.system);
      bodies.push_back({.system = &body.system,
                        .hierarchy = &body.hierarchy,
                        .x = &body.state.x,
                        .X = &body.mesh.X,
                        .mean_tet_volume = body.rest.volume[0],
                        .rest = &body.rest,
                        .factor = &body.factor});
    }
    for (RigidBox& box : rigid) {
      const Mat3 I = box.inertia_W();
      RigidPart part{box.mass, box.p, I, box.v, box.w, box.mass * (box.v + dt * gravity), I * box.w};
      bodies.push_back({.rigid = box.movable ? std::optional(part) : std::nullopt});
    }
    return bodies;
  }

  void step() {
    const std::vector<IslandBody> bodies = assemble();
    detect();
    islands = composite_islands(bodies, rows);
    const IslandOptions options{solve, passes, settings.raw_damping, solver};
    solve_all(islands, bodies, std::vector(islands.size(), options), memory, *pool, *memories, solutions);
    memory.entries.clear();
    for (const CompositeIsland& island : islands) contact::remember_friction(island.rows, memory);
    memory.make_index();
    advance();
  }

  void advance() {
    for (std::size_t k = 0; k < islands.size(); ++k)
      for (std::size_t s = 0; s < islands[k].soft.size(); ++s)
        fem::advance(solutions[k].soft_velocity(static_cast<int>(s)), dt, soft[islands[k].soft[s]].state);
    for (RigidBox& box : rigid)
      if (box.movable) box.v += dt * gravity;
    for (const IslandSolution& solution : solutions)
      for (const ContactImpulse& hit : solution.impulses) {
        RigidBox& box = rigid[hit.body - soft.size()];
        box.v += hit.impulse_W / box.mass;
        box.w += box.inertia_W().ldlt().solve((hit.point_W - box.p).cross(hit.impulse_W));
      }
    for (RigidBox& box : rigid) {
      box.p += dt * box.v;
      const double angle = dt * box.w.norm();
      if (angle > 0) box.R = (Quat(Eigen::AngleAxisd(angle, box.w.normalized())) * box.R).normalized();
    }
  }

  void run(double seconds) {
    for (int k = 0; k < std::lround(seconds / dt); ++k) step();
  }
};

}  // namespace crumple::sim::islands
