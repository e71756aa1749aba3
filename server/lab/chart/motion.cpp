#include "server/lab/chart/motion.h"

#include "server/lab/chart/stage_split.h"
#include "server/sim/fem/bdf2.h"
#include "server/sim/linear_solver/cholesky.h"
#include "server/sim/state_hash.h"
#include "server/sim/world.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace crumple::lab::chart {
namespace {

namespace fem = sim::fem;

constexpr int kFirstBody = 0;

void sample(const std::vector<Vec3>& start, const std::vector<Vec3>& x, const std::vector<double>& mass,
            const std::vector<int>& probe, Motion& motion) {
  Vec3 tip = Vec3::Zero();
  for (int n : probe) tip += (x[n] - start[n]) / static_cast<double>(probe.size());
  motion.tip.insert(motion.tip.end(), tip.data(), tip.data() + 3);
  for (std::size_t n = 0; n < x.size(); ++n) {
    const Vec3 u = std::sqrt(mass[n]) * (x[n] - start[n]);
    motion.nodes.insert(motion.nodes.end(), u.data(), u.data() + 3);
  }
}

// Steps in an interval between samples; dt divides it.
int steps_a_sample(double dt) { return static_cast<int>(std::lround(kSampleInterval / dt)); }
int sample_count(double end) { return static_cast<int>(std::lround(end / kSampleInterval)); }

bool finite(const std::vector<double>& values) {
  for (double v : values) {
    if (!std::isfinite(v)) return false;
  }
  return true;
}

std::vector<Vec3> placed(const sim::BodyDescription& body, const std::vector<Vec3>& X) {
  std::vector<Vec3> x;
  for (const Vec3& p : X) x.push_back(body.pose * p);
  return x;
}

}  // namespace

double now_seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

Result<Motion> step_world(const sim::SceneDescription& scene, int threads, double end, const std::vector<int>& probe) {
  auto made = sim::World::create(scene, {.threads = threads});
  if (!made) return std::unexpected(made.error());
  sim::World& world = **made;
  const auto& model = std::get<sim::FemModel>(scene.bodies[kFirstBody].model);
  auto rest = fem::make_rest_body(*model.mesh, model.material, model.clamp_limit, model.regions, model.element);
  if (!rest) return std::unexpected(rest.error());
  const std::vector<Vec3> start = world.fem(kFirstBody).x;

  Motion motion;
  StageSplit split(world);
  double iterations = 0, fastest = 0;
  const auto energy = [&] {
    const sim::Energies e = world.energies();
    fastest = std::max(fastest, e.kinetic);
    return e.kinetic + e.elastic + e.gravitational;
  };
  const double at_start = energy();
  const int samples = sample_count(end), steps = steps_a_sample(scene.dt);
  for (int s = 0; s < samples; ++s) {
    const double from = now_seconds();
    for (int k = 0; k < steps; ++k) {
      const sim::StepReport report = world.step();
      split.add();
      iterations += report.solver_iterations;
      motion.capped_steps += report.capped_solves > 0;
    }
    motion.seconds += (now_seconds() - from) / end;
    world.take_events();
    sample(start, world.fem(kFirstBody).x, rest->node_mass, probe, motion);
    motion.energy = energy();
  }
  motion.iterations = iterations / (samples * steps);
  motion.energy_lost = fastest > 0 ? (at_start - motion.energy) / fastest : 0;
  split.report(motion.stages);
  if (world.fem(kFirstBody).inverted > 0) motion.failure = "inverted elements at the end";
  if (!finite(motion.nodes)) motion.failure = "not finite";
  return motion;
}

Result<Motion> step_directly(const sim::SceneDescription& scene, double end, const std::vector<int>& probe) {
  const auto& model = std::get<sim::FemModel>(scene.bodies[kFirstBody].model);
  auto rest = fem::make_rest_body(*model.mesh, model.material, model.clamp_limit, model.regions, model.element);
  if (!rest) return std::unexpected(rest.error());
  const std::vector<Vec3> start = placed(scene.bodies[kFirstBody], model.mesh->X);
  fem::FemState state{start, std::vector<Vec3>(start.size(), Vec3::Zero()),
                      std::vector<Mat3>(rest->point_count(), Mat3::Zero())};
  std::vector<fem::PrescribedNode> held;
  for (const sim::NodeMotion& motion : model.motions) {
    for (int n : motion.nodes) held.push_back({n, Vec3::Zero()});
  }
  Eigen::VectorXd f_ext(3 * start.size());
  for (std::size_t n = 0; n < start.size(); ++n) f_ext.segment<3>(3 * n) = rest->node_mass[n] * scene.gravity;

  Motion motion;
  const sim::ThreadPool pool(1);
  fem::StepScratch scratch;
  fem::Bdf2Scratch bdf2;
  const bool two_steps = scene.integrator == sim::Integrator::bdf2;
  sim::linear_solver::Cholesky solver;
  const double from = now_seconds();
  for (int s = 0; s < sample_count(end); ++s) {
    for (int k = 0; k < steps_a_sample(scene.dt); ++k) {
      if (two_steps) fem::restart_near_inversion(*rest, model.mesh->tets, scene.dt, pool, state);
      const fem::StepFormula formula = fem::remembers(state) ? fem::bdf2_formula(state, scene.dt, held, bdf2)
                                                             : fem::backward_euler_formula(state, scene.dt);
      fem::assemble(*rest, model.mesh->tets, state, formula, f_ext, held, pool, scratch.system);
      if (!solver.factor(std::get<sim::linear_solver::BlockSparseMatrix<double>>(scratch.system.A))) {
        return std::unexpected(Error{ErrorCode::internal, "direct reference", "is not positive definite"});
      }
      fem::advance_bdf2(solver.solve(scratch.system.b), scene.dt, scratch.system.prescribed, state);
      if (!two_steps) fem::forget(state);
    }
    sample(start, state.x, rest->node_mass, probe, motion);
  }
  motion.seconds = (now_seconds() - from) / end;
  return motion;
}

namespace {

void hash_mesh(sim::StateHash& hash, const sim::TetMesh& mesh) {
  for (const Vec3& p : mesh.X) hash.add(p);
  for (const Tet& t : mesh.tets) {
    for (int n : t) hash.add(static_cast<double>(n));
  }
}

void hash_material(sim::StateHash& hash, const fem::FemMaterial& m) {
  for (double v : {m.young, m.poisson, m.density, m.damping_mass, m.damping_stiffness, m.yield, m.creep, m.max_plastic,
                   m.toughness, m.friction}) {
    hash.add(v);
  }
  if (m.flow != fem::FlowRule::additive) hash.add(static_cast<double>(m.flow));
}

}  // namespace

std::uint64_t scene_hash(const sim::SceneDescription& scene) {
  sim::StateHash hash;
  hash.add(scene.gravity);
  for (const sim::BodyDescription& body : scene.bodies) {
    hash.add(body.pose.p_WB);
    hash.add(Vec3(body.pose.R_WB.vec()));
    hash.add(body.velocity);
    hash.add(static_cast<double>(body.model.index()));
    if (const auto* fem = std::get_if<sim::FemModel>(&body.model)) {
      hash_mesh(hash, *fem->mesh);
      hash_material(hash, fem->material);
      if (fem->element != fem::ElementKind::linear_tetrahedra) hash.add(static_cast<double>(fem->element));
      for (const fem::MaterialRegion& region : fem->regions) {
        for (int t : region.tets) hash.add(static_cast<double>(t));
        hash_material(hash, region.material);
      }
    } else if (const auto* example = std::get_if<sim::ExampleModel>(&body.model)) {
      hash_mesh(hash, example->set->mesh);
      hash.add(example->density);
    } else {
      const auto& rigid = std::get<sim::RigidModel>(body.model);
      for (double v : {rigid.mass, rigid.density, rigid.friction, static_cast<double>(rigid.shapes.size())}) hash.add(v);
    }
  }
  return hash.value();
}

std::uint64_t level_hash(const Level& level, const Material& material) {
  sim::StateHash hash;
  hash_mesh(hash, level.mesh);
  for (Eigen::Index k = 0; k < level.loads.size(); ++k) hash.add(level.loads[k]);
  for (const Dirichlet& d : level.dirichlet) {
    hash.add(static_cast<double>(3 * d.node + d.dof));
    hash.add(d.value);
  }
  for (double v : {material.young, material.poisson, material.density}) hash.add(v);
  if (material.element != fem::ElementKind::linear_tetrahedra) hash.add(static_cast<double>(material.element));
  return hash.value();
}

}  // namespace crumple::lab::chart
