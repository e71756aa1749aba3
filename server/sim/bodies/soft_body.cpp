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
  soft.name_ = body.name;
  soft.colour_ = body.colour;
  soft.opacity_ = body.opacity;
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
  soft.state.plastic_strain.assign(soft.rest.point_count(), Mat3::Zero());
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
  if (model.splinters || soft.rest.dusty()) soft.faces_ = SharedFaces(mesh.tets);
  auto skin = SoftSkin::make(model, soft.rest.breakable(), soft.faces_);
  if (!skin) return std::unexpected(Error{skin.error().code, field + "." + skin.error().field, skin.error().message});
  soft.skin_ = *std::move(skin);
  soft.stars_ = NodeStars(soft.tets, soft.node_count());
  for (int n = 0; n < soft.node_count(); ++n) soft.scene_nodes_.push_back({-1, n});
  for (int t = 0; t < mesh.tet_count(); ++t) soft.scene_tets_.push_back({-1, t});
  soft.scene_tet_of_.resize(mesh.tets.size());
  std::iota(soft.scene_tet_of_.begin(), soft.scene_tet_of_.end(), 0);
  soft.rigid_fragment_tets_ = soft.rest.breakable() ? model.rigid_fragments : 0;
  if (model.self_contact) soft.self_contact.emplace();
  soft.follow_tets();
  soft.draw();
  return soft;
}

void SoftBody::follow_tets() { follow_mesh(contact::make_collision_mesh(tets, X, tet_mass_)); }

void SoftBody::follow_mesh(contact::CollisionMesh mesh) {
  collision = std::move(mesh);
  if (self_contact) self_contact = contact::make_self_contact(collision, X);
  impulse = Eigen::VectorXd::Zero(3 * node_count());
  v_before.clear();
}

void SoftBody::draw() {
  const std::vector<int> parted = faces_.part([&](int scene_tet) {
    const TetRef at = scene_tets_[scene_tet];
    const Tet& nodes = shape().nodes(at);
    std::array<std::uint64_t, 4> ids;
    for (int k = 0; k < 4; ++k) ids[k] = (static_cast<std::uint64_t>(at.fragment + 1) << 32) | static_cast<std::uint32_t>(nodes[k]);
    return ids;
  });
  skin_.rebuild(shape(), faces_, parted);
  torn_.insert(torn_.end(), parted.begin(), parted.end());
}

void SoftBody::prepare(const Vec3& gravity, double dt, const ThreadPool& pool) {
  if (is_empty()) return;
  std::vector<fem::PrescribedNode> held;
  for (const DrivenNodes& driven : driven_)
    for (const int n : driven.motion.nodes) held.push_back({n, state.v[n]});
  fem::assemble(rest, tets, state, external_force(gravity), dt, held, pool, system);
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

void SoftBody::push(const Vec3& impulse_W, const Vec3& point_W, double radius) {
  pushed_ = true;
  std::vector<NodeRef> nodes;
  std::vector<double> weights;
  NodeRef nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto weigh = [&](const NodeRef& at, const Vec3& x, double mass, bool held) {
    const double distance = (x - point_W).norm();
    if (distance < least) least = distance, nearest = at;
    if (distance >= radius || held) return;
    const double s = 1 - distance * distance / (radius * radius);
    nodes.push_back(at);
    weights.push_back(mass * s * s);
  };
  for (int n = 0; n < node_count(); ++n) weigh({-1, n}, state.x[n], rest.node_mass[n], fixed[n]);
  for (int f = 0; f < static_cast<int>(fragments.size()); ++f) {
    const RigidFragment& fragment = fragments[f];
    for (int n = 0; n < fragment.node_count(); ++n)
      weigh({f, n}, fragment.x()[n], fragment.piece().node_mass[n], fragment.is_held());
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (sum <= 0) return push_node(nearest, impulse_W);
  for (std::size_t k = 0; k < nodes.size(); ++k) push_node(nodes[k], weights[k] / sum * impulse_W);
}

void SoftBody::push_nodes(const Vec3& impulse_W, std::span<const int> nodes) {
  pushed_ = true;
  const auto mass_of = [&](const NodeRef& at) {
    return at.fragment < 0 ? rest.node_mass[at.node] : fragments[at.fragment].piece().node_mass[at.node];
  };
  double sum = 0;
  for (int n : nodes) sum += mass_of(scene_nodes_[n]);
  for (int n : nodes) {
    const double share = sum > 0 ? mass_of(scene_nodes_[n]) / sum : 1.0 / static_cast<double>(nodes.size());
    push_node(scene_nodes_[n], share * impulse_W);
  }
}

Vec3 SoftBody::centre_of_mass() const {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (int n = 0; n < node_count(); ++n) {
    sum += rest.node_mass[n] * state.x[n];
    mass += rest.node_mass[n];
  }
  for (const RigidFragment& fragment : fragments) {
    sum += fragment.mass() * fragment.com();
    mass += fragment.mass();
  }
  return sum / mass;
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

BodyTopology SoftBody::topology() const {
  BodyTopology drawn{.id = id, .name = name_, .model = BodyModel::fem, .deformable = true};
  drawn.colour = colour_;
  drawn.opacity = opacity_;
  drawn.triangles = skin_.triangles();
  drawn.channels = {"stress"};
  BodyFrame frame;
  capture(false, frame);
  drawn.vertices = std::move(frame.positions);
  return drawn;
}

void SoftBody::capture(bool with_values, BodyFrame& frame) const {
  frame.id = id;
  frame.pose.p_WB = centre_of_mass();
  frame.positions.clear();
  frame.values.clear();
  const std::vector<float> values = with_values ? node_values() : std::vector<float>{};
  skin_.capture(shape(), with_values ? &values : nullptr, frame);
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
