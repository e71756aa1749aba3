#include "server/sim/model_validation.h"

#include <Eigen/Eigenvalues>

#include "server/sim/limits.h"

#include <cmath>

namespace crumple::sim {
namespace {

std::string entry(const std::string& list, std::size_t i) { return list + "[" + std::to_string(i) + "]"; }

void check_points(FirstBreach& breach, const std::vector<Vec3>& points, const std::string& field) {
  for (std::size_t i = 0; breach.ok() && i < points.size(); ++i)
    if (!(points[i].cwiseAbs().maxCoeff() <= kMaxPosition) || !points[i].allFinite())
      breach.vector(points[i], kMaxPosition, entry(field, i));
}

void check_keys(FirstBreach& breach, const std::vector<PoseKey>& keys, const std::string& field) {
  breach.count(keys.size(), 0, limits::kMaxKeys, field);
  for (std::size_t i = 0; breach.ok() && i < keys.size(); ++i) {
    const std::string key = entry(field, i);
    breach.number(keys[i].time, limits::kTime, key + ".time");
    if (i > 0)
      breach.require(keys[i].time > keys[i - 1].time, key + ".time",
                     "is " + number_text(keys[i].time) + ", must be above the key before it (" +
                         number_text(keys[i - 1].time) + ")");
    breach.pose(keys[i].pose, key + ".pose");
  }
}

template <class Mesh>
void check_mesh(FirstBreach& breach, const Mesh& mesh, const std::string& field) {
  breach.take(validate(mesh, field));
  if constexpr (std::is_same_v<Mesh, TetMesh>)
    check_points(breach, mesh.X, field + ".X");
  else if constexpr (std::is_same_v<Mesh, SplinterMesh>)
    check_points(breach, mesh.surface.vertices, field + ".surface.vertices");
  else
    check_points(breach, mesh.vertices, field + ".vertices");
}

// A mesh that may be shared; null is allowed.
template <class Mesh>
void check_shared(FirstBreach& breach, const std::shared_ptr<const Mesh>& mesh, const std::string& field,
                  SeenAssets& seen) {
  if (!breach.ok() || !mesh || seen.valid.contains(mesh.get())) return;
  check_mesh(breach, *mesh, field);
  if (breach.ok()) seen.valid.insert(mesh.get());
}

// Thickness over length, by the covariance of the points: 0 when they lie in a plane.
double relative_thickness(const std::vector<Vec3>& points) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p / static_cast<double>(points.size());
  Mat3 covariance = Mat3::Zero();
  for (const Vec3& p : points) covariance += (p - mean) * (p - mean).transpose();
  const Vec3 squares = Eigen::SelfAdjointEigenSolver<Mat3>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  return squares[2] > 0 ? std::sqrt(std::max(0.0, squares[0]) / squares[2]) : 0;
}

double enclosed_volume(const SurfaceMesh& mesh) {
  double volume = 0;
  const Vec3 apex = mesh.vertices.front();
  for (const Triangle& t : mesh.triangles)
    volume += (mesh.vertices[t[0]] - apex).cross(mesh.vertices[t[1]] - apex).dot(mesh.vertices[t[2]] - apex) / 6;
  return volume;
}

// One of the six shapes; `moving` bodies need a volume.
struct ShapeCheck {
  FirstBreach& breach;
  const std::string& field;
  bool moving;

  void operator()(const Box& box) {
    static constexpr const char* kAxes[] = {".x", ".y", ".z"};
    for (int i = 0; i < 3; ++i)
      breach.number(box.half_extents[i], limits::kLength, field + ".box.half_extents" + kAxes[i]);
  }
  void operator()(const Sphere& sphere) { breach.number(sphere.radius, limits::kLength, field + ".sphere.radius"); }
  void operator()(const Cylinder& cylinder) {
    breach.number(cylinder.radius, limits::kLength, field + ".cylinder.radius");
    breach.number(cylinder.half_length, limits::kLength, field + ".cylinder.half_length");
  }
  void operator()(const Plane& plane) {
    breach.require(!moving, field + ".plane", "belongs to a body that moves, must belong to a FIXED one");
    breach.vector(plane.normal, 2, field + ".plane.normal");
    breach.require(std::abs(plane.normal.norm() - 1) <= 1e-6, field + ".plane.normal",
                   "has length " + number_text(plane.normal.norm()) + ", must have unit length");
    breach.number(plane.offset, {-kMaxPosition, kMaxPosition}, field + ".plane.offset");
  }
  void operator()(const ConvexHull& hull) {
    breach.count(hull.points.size(), 4, limits::kMaxHullPoints, field + ".convex_hull.points");
    check_points(breach, hull.points, field + ".convex_hull.points");
    // 1e-6: rounding leaves about 1e-8 of the length
    if (breach.ok())
      breach.require(relative_thickness(hull.points) > 1e-6, field + ".convex_hull.points",
                     "lie in one plane, must enclose a volume");
  }
  void operator()(const TriangleShape& triangles) {
    check_mesh(breach, triangles.mesh, field + ".triangles.mesh");
    if (moving && breach.ok())
      breach.require(enclosed_volume(triangles.mesh) > 1e-12, field + ".triangles.mesh",
                     "encloses no volume or is inside out, must be counter-clockwise from outside in a moving body");
  }
};

void check_material(FirstBreach& breach, const fem::FemMaterial& m, const std::string& field) {
  breach.number(m.young, limits::kYoung, field + ".young");
  breach.number(m.poisson, limits::kPoisson, field + ".poisson_ratio");
  breach.number(m.density, limits::kDensity, field + ".density");
  breach.number(m.damping_mass, limits::kDampingMass, field + ".damping_mass");
  breach.number(m.damping_stiffness, limits::kDampingStiffness, field + ".damping_stiffness");
  breach.number(m.yield, limits::kYield, field + ".yield");
  breach.number(m.creep, limits::kUnit, field + ".creep");
  breach.number(m.max_plastic, limits::kMaxPlastic, field + ".max_plastic");
  breach.number(m.toughness, limits::kToughness, field + ".toughness");
  breach.number(m.fracture_interval, limits::kCount, field + ".fracture_interval");
  breach.number(m.max_splits_per_step, limits::kCount, field + ".max_splits_per_step");
  breach.number(m.dust, limits::kDust, field + ".dust");
  breach.number(m.friction, limits::kFriction, field + ".friction");
  breach.number(m.cg_tolerance, limits::kTolerance, field + ".cg_tolerance");
  breach.number(m.cg_max_iterations, limits::kIterations, field + ".cg_max_iterations");
}

void check_motions(FirstBreach& breach, const FemModel& model, const std::string& field) {
  breach.count(model.motions.size(), 0, limits::kMaxMotions, field);
  if (!breach.ok()) return;
  std::vector<char> taken(model.mesh->X.size(), 0);
  for (std::size_t m = 0; breach.ok() && m < model.motions.size(); ++m) {
    const std::string nodes = entry(field, m) + ".nodes";
    breach.require(!model.motions[m].nodes.empty(), nodes, "is empty, must select one node at least");
    for (const int node : model.motions[m].nodes) {
      if (node < 0 || node >= model.mesh->node_count())
        return breach.require(false, nodes,
                              "names node " + std::to_string(node) + ", must be below the mesh's " +
                                  std::to_string(model.mesh->node_count()) + " nodes");
      if (taken[static_cast<std::size_t>(node)]++)
        return breach.require(false, nodes, "names node " + std::to_string(node) + " again, must name a node once");
    }
    check_keys(breach, model.motions[m].keys, entry(field, m) + ".keys");
  }
}

void check_parameters(FirstBreach& breach, const example_based::ExampleParameters& p, const std::string& field) {
  breach.number(p.alpha, limits::kAlpha, field + ".alpha");
  breach.number(p.beta, limits::kBeta, field + ".beta");
  breach.number(p.gamma, limits::kGamma, field + ".gamma");
  breach.number(p.lambda, limits::kLambda, field + ".lambda");
  breach.number(p.mu, limits::kRestitutionRate, field + ".mu");
  breach.number(p.nu, limits::kRestitutionRate, field + ".nu");
  breach.number(p.restitution, limits::kUnit, field + ".restitution");
  breach.require(!(p.triangle_collision && p.tet_collision), field + ".tet_collision",
                 "is true and so is triangle_collision, at most one must be");
  breach.number(p.goal_tolerance, limits::kGoalTolerance, field + ".goal_tolerance");
  breach.number(p.fatigue_time, limits::kFatigueTime, field + ".fatigue_time");
}

}  // namespace

Result<void> validate(const RigidModel& model, const std::string& field, SeenAssets& seen) {
  FirstBreach breach;
  breach.count(model.shapes.size(), 1, limits::kMaxShapes, field + ".shapes");
  for (std::size_t i = 0; breach.ok() && i < model.shapes.size(); ++i) {
    const std::string shape = entry(field + ".shapes", i);
    breach.pose(model.shapes[i].pose, shape + ".pose");
    std::visit(ShapeCheck{breach, shape, model.kind != RigidKind::fixed}, model.shapes[i].shape);
  }
  breach.number(model.density, limits::kDensity, field + ".density");
  breach.number(model.mass, limits::kMass, field + ".mass");
  breach.number(model.friction, limits::kFriction, field + ".friction");
  breach.number(model.restitution, limits::kUnit, field + ".restitution");
  breach.require(model.motion.empty() || model.kind == RigidKind::kinematic, field + ".motion",
                 "belongs to a body that is not KINEMATIC, must be empty");
  check_keys(breach, model.motion, field + ".motion");
  check_shared(breach, model.proxy, field + ".proxy", seen);
  check_shared(breach, model.render, field + ".render", seen);
  return breach.result();
}

Result<void> validate(const FemModel& model, const std::string& field, SeenAssets& seen) {
  FirstBreach breach;
  breach.require(model.mesh != nullptr, field + ".mesh", "is missing");
  check_shared(breach, model.mesh, field + ".mesh", seen);
  check_material(breach, model.material, field + ".material");
  if (breach.ok())
    breach.take(fem::validate(model.regions, model.material, model.mesh->tet_count(), field + ".regions"));
  for (std::size_t r = 0; breach.ok() && r < model.regions.size(); ++r)
    check_material(breach, model.regions[r].material, entry(field + ".regions", r) + ".material");
  if (breach.ok()) check_motions(breach, model, field + ".motions");
  breach.number(model.clamp_limit, limits::kClampLimit, field + ".clamp_limit");
  breach.number(model.rigid_fragments, limits::kRigidFragments, field + ".rigid_fragments");
  check_shared(breach, model.render, field + ".render", seen);
  check_shared(breach, model.splinters, field + ".splinters", seen);
  return breach.result();
}

Result<void> validate(const ExampleModel& model, const std::string& field, SeenAssets& seen) {
  FirstBreach breach;
  breach.require(model.set != nullptr, field + ".asset", "is missing");
  if (breach.ok() && !seen.valid.contains(model.set.get())) {
    breach.take(example_based::validate(*model.set, field + ".asset"));
    check_points(breach, model.set->mesh.X, field + ".asset.mesh.X");
    if (breach.ok()) seen.valid.insert(model.set.get());
  }
  check_parameters(breach, model.parameters, field + ".parameters");
  breach.number(model.density, limits::kDensity, field + ".density");
  breach.number(model.mass, limits::kMass, field + ".mass");
  breach.number(model.friction, limits::kFriction, field + ".friction");
  return breach.result();
}

std::int64_t tet_count(const BodyDescription& body) {
  if (const auto* fem = std::get_if<FemModel>(&body.model)) return fem->mesh->tet_count();
  if (const auto* example = std::get_if<ExampleModel>(&body.model)) return example->set->mesh.tet_count();
  const auto& rigid = std::get<RigidModel>(body.model);
  return rigid.proxy ? rigid.proxy->tet_count() : 0;
}

}  // namespace crumple::sim
