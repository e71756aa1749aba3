#include "server/sim/bodies/soft_body.h"

#include "server/sim/fem/float_matrix.h"
#include "server/sim/finite.h"
#include "server/sim/motion.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace crumple::sim {
namespace {

// Tags the error of a room below with where in the scene it is.
std::vector<double> tet_masses_of(const fem::RestBody& rest) {
  std::vector<double> masses(rest.tet_count());
  for (int t = 0; t < rest.tet_count(); ++t) masses[t] = rest.tet_mass(t);
  return masses;
}

// The stress that is drawn in full colour: where the material gives way, if it does; else 5 % strain.
double drawn_stress(const fem::FemMaterial& material) {
  if (material.breakable && !material.raw_toughness) return material.toughness;
  const double shear = material.young / (2 * (1 + material.poisson));
  if (std::isfinite(material.yield)) return std::sqrt(6.0) * shear * material.yield;
  return 0.05 * material.young;
}

}  // namespace

Result<SoftBody> SoftBody::make(BodyId id, const BodyDescription& body, const FemModel& model,
                                const SoftBodyOptions& options, const std::string& field) {
  const TetMesh& mesh = *model.mesh;
  auto rest = fem::make_rest_body(mesh, model.material, model.clamp_limit, model.regions, model.element);
  if (!rest) return std::unexpected(Error{rest.error().code, field + "." + rest.error().field, rest.error().message});

  SoftBody soft;
  soft.id = id;
  soft.pose_at_start_ = body.pose;
  soft.tets = mesh.tets;
  soft.X = mesh.X;
  soft.rest = std::move(*rest);
  soft.mean_tet_volume =
      std::accumulate(soft.rest.volume.begin(), soft.rest.volume.end(), 0.0) / soft.rest.tet_count();
  soft.system = fem::StepSystem(options.float_solver ? *options.float_solver : fem::takes_float(soft.rest, options.dt));
  soft.options_ = options;
  soft.tet_mass_ = tet_masses_of(soft.rest);
  for (int k = 0; k < soft.rest.material_count(); ++k) {
    soft.material_rotation_.push_back(soft.rest.material_at(k).rotation);
    soft.value_scale_.push_back(drawn_stress(soft.rest.material_at(k)));
  }
  if (soft.rest.yields()) soft.state.plastic_strain.assign(soft.rest.point_count(), Mat3::Zero());
  for (const Vec3& X : mesh.X) {
    const Vec3 x = body.pose * X;
    soft.state.x.push_back(x);
    soft.state.v.push_back(body.velocity + body.angular_velocity.cross(x - body.pose.p_WB));
  }
  // A node without a tet has no mass and no equation: it is held where it is.
  soft.fixed.assign(mesh.X.size(), 0);
  NodeMotion loose;
  for (int n = 0; n < soft.node_count(); ++n) {
    if (soft.rest.node_mass[n] == 0) loose.nodes.push_back(n);
  }
  std::vector<NodeMotion> motions = model.motions;
  if (!loose.nodes.empty()) motions.push_back(loose);
  for (const NodeMotion& motion : motions) {
    DrivenNodes driven{motion, {}};
    for (int n : motion.nodes) {
      driven.at_start.push_back(soft.state.x[n]);
      soft.fixed[n] = 1;
    }
    soft.driven_.push_back(std::move(driven));
  }
  if (soft.rest.breakable()) soft.stars_ = NodeStars(soft.tets, soft.node_count());
  soft.rigid_fragment_tets_ = soft.rest.breakable() ? model.rigid_fragments : 0;
  if (model.self_contact) soft.self_contact.emplace();
  soft.follow_tets();
  return soft;
}

void SoftBody::follow_tets() { follow_mesh(contact::make_collision_mesh(tets, X, tet_mass_)); }

void SoftBody::follow_mesh(contact::CollisionMesh mesh) {
  collision = std::move(mesh);
  if (self_contact) self_contact = contact::make_self_contact(collision, X);
  impulse = Eigen::VectorXd::Zero(3 * node_count());
  v_before.clear();
}

void SoftBody::prepare(const Vec3& gravity, double dt, const ThreadPool& pool) {
  if (is_empty()) return;
  std::vector<fem::PrescribedNode> held;
  for (const DrivenNodes& driven : driven_)
    for (const int n : driven.motion.nodes) held.push_back({n, state.v[n]});
  fem::assemble(rest, tets, state, external_force(gravity), dt, held, pool, system);
}

void SoftBody::make_factors(double dt, const ThreadPool& pool) {
  factor.make(rest, X, system, system.scale, pool);
  if (options_.integrator == Integrator::bdf2) factor.make(rest, X, system, fem::bdf2_scale(dt), pool);
}

void SoftBody::prescribe(double time, double dt) {
  prescribed_before_.swap(prescribed_);
  prescribed_.clear();
  for (const DrivenNodes& driven : driven_) {
    const bool moves = !driven.motion.keys.empty();
    const Pose to = moves ? pose_at(driven.motion.keys, time + dt) : Pose{};
    for (std::size_t k = 0; k < driven.at_start.size(); ++k) {
      const int n = driven.motion.nodes[k];
      // Keys turn about the body's origin as it was at t = 0.
      const Vec3 target = moves ? pose_at_start_.p_WB + to * (driven.at_start[k] - pose_at_start_.p_WB) : driven.at_start[k];
      const Vec3 velocity = moves ? ((target - state.x[n]) / dt).eval() : Vec3::Zero();
      prescribed_.push_back({n, velocity});
      state.v[n] = velocity;
    }
  }
  if (frozen) {
    prescribed_.clear();
    for (int n = 0; n < node_count(); ++n) prescribed_.push_back({n, Vec3::Zero()});
  }
}

void SoftBody::assemble(const Vec3& gravity, double dt, const ThreadPool& pool) {
  command_force_.resize(0);
  if (is_empty()) {
    elastic_ = 0;
    return;
  }
  if (pushed_) {
    command_force_ = impulse / dt;
    impulse.setZero();
    pushed_ = false;
    restart();
  }
  whole_ahead_ = false;  // of another step
  choose_formula(dt, pool);
  if (!fem::remembers(state)) {
    assemble_backward_euler(gravity, dt, pool);
    measure(dt);
    return;
  }
  if (options_.watched) {
    fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
    measure(dt);
  }
  const fem::StepFormula formula = fem::bdf2_formula(state, dt, prescribed_, bdf2_);
  fem::assemble(rest, tets, state, formula, external_force(gravity), prescribed_, pool, system);
  elements_at_state_ = false;
}

void SoftBody::assemble_part(const Vec3& gravity, double h, const ThreadPool& pool) {
  whole_ahead_ = false;  // of another solve
  if (is_empty()) return;
  restart();
  assemble_backward_euler(gravity, h, pool);
}

void SoftBody::assemble_backward_euler(const Vec3& gravity, double h, const ThreadPool& pool) {
  fem::assemble(rest, tets, state, external_force(gravity), h, prescribed_, pool, system);
  elements_at_state_ = true;
}

const Eigen::VectorXd& SoftBody::external_force(const Vec3& gravity) {
  Eigen::VectorXd& f = external_force_;
  f.resize(3 * node_count());
  for (int n = 0; n < node_count(); ++n) f.segment<3>(3 * n) = rest.node_mass[n] * gravity;
  if (command_force_.size() > 0) f += command_force_;
  return f;
}

bool SoftBody::advance(Eigen::Ref<const Eigen::VectorXd> v_plus, double dt) {
  assert(!is_empty());
  if (frozen) return true;
  bool finite = all_finite(v_plus);
  for (int n = 0; finite && n < node_count() && command_force_.size() > 0; ++n) {
    if (fixed[n]) continue;
    command_work_ += dt * command_force_.segment<3>(3 * n).dot(0.5 * (state.v[n] + v_plus.segment<3>(3 * n)));
  }
  x_before_ = state.x;
  v_before = state.v;
  if (options_.integrator == Integrator::bdf2) {
    was_rough_ = !fem::remembers(state);
    fem::advance_bdf2(v_plus, dt, fixed, state);
  } else {
    fem::advance(v_plus, dt, state);
  }
  const Eigen::Map<const Eigen::VectorXd> x(state.x.front().data(), v_plus.size());
  finite = finite && x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < kMaxPosition;
  if (finite) return true;
  state.x = x_before_;
  freeze();
  return false;
}

void SoftBody::freeze() {
  frozen = true;
  was_rough_ = false;
  restart();
  for (Vec3& v : state.v) v.setZero();
  std::fill(fixed.begin(), fixed.end(), 1);
  for (RigidFragment& fragment : fragments) fragment.hold();
}

double SoftBody::strongest_push() const {
  double push = 0;
  if (!pushed_) return push;
  for (int n = 0; n < node_count(); ++n) {
    if (!fixed[n]) push = std::max(push, impulse.segment<3>(3 * n).norm() / rest.node_mass[n]);
  }
  return push;
}

void SoftBody::forget_pushes() {
  if (pushed_) impulse.setZero();
  pushed_ = false;
}

double SoftBody::driven_speed() const {
  double speed = 0;
  for (const fem::PrescribedNode& p : prescribed_) speed = std::max(speed, p.velocity.norm());
  return speed;
}

bool SoftBody::is_kinematic() const {
  return !is_empty() && std::all_of(fixed.begin(), fixed.end(), [](char is_fixed) { return is_fixed != 0; });
}

void SoftBody::stop() {
  for (Vec3& v : state.v) v.setZero();
  for (fem::PrescribedNode& p : prescribed_) p.velocity.setZero();
  v_before.clear();
  restart();
  was_rough_ = false;
}

void SoftBody::assemble_kinematic(const ThreadPool& pool) {
  const auto moves = [](const fem::PrescribedNode& p) { return !p.velocity.isZero(0); };
  const bool moved = std::ranges::any_of(prescribed_before_, moves);  // what it moved in the last step is to be seen now
  if (!moved && !std::ranges::any_of(prescribed_, moves)) return;
  fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
}

void SoftBody::follow_script(double dt) {
  if (frozen) return;
  for (const fem::PrescribedNode& p : prescribed_) {
    state.v[p.node] = p.velocity;
    state.x[p.node] += dt * p.velocity;
  }
}

int SoftBody::inverted(const ThreadPool& pool) const {
  if (is_empty()) return 0;
  const bool counted = elements_at_state_ && !rest.grouped() && system.elements.is_of(rest);
  return counted ? fem::inverted_count(system.elements) : fem::inverted_count(tets, state.x, pool);
}

SoftBody::Energy SoftBody::energy(const Vec3& gravity) const {
  Energy energy{.moving = elastic_};
  for (int n = 0; n < node_count(); ++n) {
    if (fixed[n]) continue;
    energy.moving += 0.5 * rest.node_mass[n] * state.v[n].squaredNorm();
    energy.gravitational -= rest.node_mass[n] * gravity.dot(state.x[n]);
  }
  return energy;
}

void SoftBody::use_rotation(bool safe) {
  for (int k = 0; k < rest.material_count(); ++k) {
    rest.material_at(k).rotation = safe ? fem::RotationRule::svd : material_rotation_[k];
  }
}

void SoftBody::plastic_flow(double dt, double creep_dt, const ThreadPool& pool) {
  if (frozen || is_empty()) return;
  fem::plastic_flow(rest, tets, state.x, dt, creep_dt, pool, state.plastic_strain, system.elements);
  elements_at_state_ = elements_at_state_ || rest.yields();
}

void SoftBody::push(const Vec3& impulse_W, int node) {
  pushed_ = true;
  impulse.segment<3>(3 * node) += impulse_W;
}

double SoftBody::mass() const {
  double mass = rest.mass();
  for (const RigidFragment& fragment : fragments) mass += fragment.mass();
  return mass;
}

Vec3 SoftBody::mass_moment() const {
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < node_count(); ++n) sum += rest.node_mass[n] * state.x[n];
  for (const RigidFragment& fragment : fragments) sum += fragment.mass() * fragment.com();
  return sum;
}

Vec3 SoftBody::momentum() const {
  Vec3 sum = Vec3::Zero();
  for (int n = 0; n < node_count(); ++n) sum += rest.node_mass[n] * state.v[n];
  for (const RigidFragment& fragment : fragments) sum += fragment.mass() * fragment.velocity();
  return sum;
}

std::vector<double> SoftBody::von_mises() const {
  std::vector<double> values(tets.size());
  // Of what was never assembled or moved: stress-free.
  if (rest.grouped() ? system.tets.empty() && !system.elements.is_of(rest) : system.elements.sigma.size() < tets.size()) return values;
  const bool at_state = elements_at_state_ && system.elements.is_of(rest);
  const fem::Elements now = at_state ? fem::Elements{} : elements_now();
  const fem::Elements& elements = at_state ? system.elements : now;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    values[t] = fem::von_mises(rest.grouped() ? fem::element_stress(rest, elements, t) : elements.sigma[t]);
  }
  return values;
}

std::vector<float> SoftBody::node_values() const {
  std::vector<double> sum(X.size(), 0), weight(X.size(), 0);
  const std::vector<double> stress = von_mises();
  for (std::size_t t = 0; t < tets.size(); ++t) {
    for (int n : tets[t]) {
      sum[n] += rest.volume[t] * stress[t] / value_scale_[rest.heterogeneous() ? rest.material_id[t] : 0];
      weight[n] += rest.volume[t];
    }
  }
  std::vector<float> values(X.size(), 0);
  for (std::size_t n = 0; n < X.size(); ++n) {
    if (weight[n] > 0) values[n] = static_cast<float>(std::clamp(sum[n] / weight[n], 0.0, 1.0));
  }
  return values;
}

void SoftBody::hash(StateHash& hash) const {
  hash.add(static_cast<std::uint64_t>(X.size()));
  hash.add(std::span<const Vec3>(state.x));
  hash.add(std::span<const Vec3>(state.v));
  hash.add(std::span<const Vec3>(v_before));
  hash.add(std::span<const Mat3>(state.plastic_strain));
  hash.add(std::span<const Vec3>(state.x_before));
  hash.add(std::span<const Vec3>(state.v_before));
  hash.add(static_cast<std::uint64_t>(state.rough_steps));
  for (const Tet& tet : tets) {
    for (int n : tet) hash.add(static_cast<std::uint64_t>(n));
  }
  for (const RigidFragment& fragment : fragments) fragment.hash(hash);
  hash.add(static_cast<std::uint64_t>(frozen));
}

}  // namespace crumple::sim
