#include "common/text.h"
#include "server/authoring/rig.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"
#include "server/sim/mesh/tet_tree.h"
#include "server/sim/world.h"

#include <Eigen/SVD>

#include <cmath>
#include <map>

namespace crumple::lab::chart {
namespace {

const Vec3 kSize(0.6, 0.4, 0.4);         // [m]
constexpr double kDensity = 1000;        // 96 kg
constexpr double kImpulse = 500;         // [N s], on the +x side, inwards
constexpr double kRadius = 0.12;         // that it is spread over [m]
constexpr double kEnd = 0.5;             // [s]: at rest in itself by then

sim::TetMesh block(int cells) {
  return *authoring::centred_box_mesh(kSize, {3 * cells / 2, cells, cells}, authoring::Lattice::kuhn);
}

// The block's surface, finely enough triangulated to be compared vertex by vertex.
const sim::SurfaceMesh& surface() {
  static const sim::SurfaceMesh made = [] {
    const sim::TetMesh mesh = block(8);
    sim::SurfaceMesh out;
    std::map<int, int> id;
    for (const sim::SurfaceFace& face : sim::surface_faces(mesh.tets)) {
      Triangle triangle{};
      for (int a = 0; a < 3; ++a) {
        const auto [at, added] = id.try_emplace(face.nodes[a], static_cast<int>(out.vertices.size()));
        if (added) out.vertices.push_back(mesh.X[face.nodes[a]]);
        triangle[a] = at->second;
      }
      out.triangles.push_back(triangle);
    }
    return out;
  }();
  return made;
}

// What is left of x - X when the rigid motion that fits best (Kabsch) is taken out of x.
std::vector<Vec3> shape_change(const std::vector<Vec3>& X, const std::vector<Vec3>& x) {
  const double n = static_cast<double>(X.size());
  Vec3 mean_X = Vec3::Zero(), mean_x = Vec3::Zero();
  for (std::size_t k = 0; k < X.size(); ++k) {
    mean_X += X[k] / n;
    mean_x += x[k] / n;
  }
  Mat3 H = Mat3::Zero();
  for (std::size_t k = 0; k < X.size(); ++k) H += (x[k] - mean_x) * (X[k] - mean_X).transpose();
  const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 sign(1, 1, (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0 ? -1 : 1);
  const Mat3 R = svd.matrixV() * sign.asDiagonal() * svd.matrixU().transpose();  // turns x back
  std::vector<Vec3> u;
  for (std::size_t k = 0; k < X.size(); ++k) u.push_back(R * (x[k] - mean_x) - (X[k] - mean_X));
  return u;
}

std::vector<double> flat(const std::vector<Vec3>& rows) {
  std::vector<double> out;
  for (const Vec3& r : rows) out.insert(out.end(), r.data(), r.data() + 3);
  return out;
}

struct Struck {
  std::vector<Vec3> u;      // of the surface's vertices, rigid motion taken out [m]
  std::vector<Vec3> nodes;  // the same of a finite-element body's nodes
  Sample sample;
};

Result<Struck> strike(const sim::BodyDescription& body, const Setup& setup) {
  sim::SceneDescription scene{.name = "dent", .gravity = Vec3::Zero(), .dt = setup.dt};
  scene.sleep.speed = 0;
  scene.bodies.push_back(body);
  auto made = sim::World::create(scene, {.threads = setup.threads});
  if (!made) return std::unexpected(made.error());
  sim::World& world = **made;
  const sim::ApplyImpulse hit{.body = 0, .impulse = {-kImpulse, 0, 0}, .point = {0.5 * kSize.x(), 0, 0}, .radius = kRadius};
  if (auto taken = world.submit(hit); !taken) return std::unexpected(taken.error());

  Struck struck;
  double iterations = 0;
  const double from = now_seconds();
  while (world.time() < kEnd - 1e-9) iterations += world.step().solver_iterations;
  struck.sample.values = {{"seconds", (now_seconds() - from) / kEnd}};
  // The other models solve nothing.
  if (std::holds_alternative<sim::FemModel>(body.model)) struck.sample.values["iterations"] = iterations / static_cast<double>(world.step_count());
  const double speed = kImpulse / (kDensity * kSize.prod());
  struck.sample.values["error_motion"] = (world.velocity(0) - Vec3(-speed, 0, 0)).norm() / speed;

  const Frame frame = world.capture();
  std::vector<Vec3> x;
  for (const Vec3f& p : frame.bodies[0].positions) x.push_back(p.cast<double>());
  if (x.empty()) x = surface().vertices;  // a rigid body's move with it
  if (x.size() != surface().vertices.size()) return invalid("dent", "is drawn by other vertices than it was given");
  struck.u = shape_change(surface().vertices, x);
  if (const auto* fem = std::get_if<sim::FemModel>(&body.model)) struck.nodes = shape_change(fem->mesh->X, world.fem(0).x);
  double deepest = 0;
  for (const Vec3& u : struck.u) deepest = std::max(deepest, u.norm());
  struck.sample.values["deepest_mm"] = 1000 * deepest;
  if (!std::isfinite(deepest)) struck.sample.failure = "not finite";
  return struck;
}

sim::BodyDescription fem_body(int cells) {
  sim::FemModel fem;
  fem.mesh = std::make_shared<sim::TetMesh>(block(cells));
  fem.material = {.young = 3e6, .poisson = 0.3, .density = kDensity, .damping_stiffness = 0.004, .yield = 0.02, .creep = 0.5, .max_plastic = 0.6};
  fem.material.cg_max_iterations = Setup{}.cg_cap;
  fem.render = std::make_shared<sim::SurfaceMesh>(surface());
  sim::BodyDescription body{.name = "block"};
  body.model = fem;
  return body;
}

struct Reference {
  std::vector<double> u;  // of the surface's vertices, three each [m]
  double floor;           // distance from the next coarser mesh
};

int finest(const Workshop& workshop) { return workshop.quick ? 8 : 16; }

Result<Reference> reference(Workshop& workshop) {
  if (!workshop.arrays.contains("dent")) {
    const Setup setup{.dt = 1.0 / 240};
    auto coarse = strike(fem_body(finest(workshop) * 3 / 4), setup);
    if (!coarse) return std::unexpected(coarse.error());
    auto fine = strike(fem_body(finest(workshop)), setup);
    if (!fine) return std::unexpected(fine.error());
    workshop.arrays["dent"] = flat(fine->u);
    workshop.arrays["dent nodes"] = flat(fine->nodes);
    workshop.floors["dent"] = relative_l2(flat(coarse->u), flat(fine->u));
  }
  return Reference{workshop.arrays["dent"], workshop.floors["dent"]};
}

// The rest displacement of the reference at any point of the block.
authoring::PoseField reference_field(const Workshop& workshop) {
  struct Field {
    explicit Field(sim::TetMesh m) : mesh(std::move(m)), tree(mesh) {}
    sim::TetMesh mesh;
    sim::TetTree tree;
    std::vector<double> u;
  };
  auto field = std::make_shared<Field>(block(finest(workshop)));
  field->u = workshop.arrays.at("dent nodes");
  return [field](const Vec3& X) -> Vec3 {
    const Tet& tet = field->mesh.tets[field->tree.nearest(X).tet];
    Mat34 corners;
    for (int a = 0; a < 4; ++a) corners.col(a) = field->mesh.X[tet[a]];
    const Eigen::Vector4d w = sim::barycentric(corners, X);
    Vec3 u = Vec3::Zero();
    for (int a = 0; a < 4; ++a) u += w[a] * Eigen::Map<const Vec3>(field->u.data() + 3 * tet[a]);
    return u;
  };
}

Result<sim::example_based::ExampleSet> example_set(const Setup& setup, const Workshop& workshop) {
  if (setup.body == BodyKind::default_rig) return authoring::make_default_asset(surface(), {.enclosing = {.cell_size = 0.1}});
  auto rig = authoring::make_rig(surface(), {.cell_size = 0.06}, 120);
  if (!rig) return std::unexpected(rig.error());
  authoring::add_example(*rig, "struck", reference_field(workshop));
  rig->set.convex_parts = {rig->surface};
  return std::move(rig->set);
}

Result<sim::BodyDescription> body_of(const Setup& setup, const Workshop& workshop) {
  if (setup.body == BodyKind::finite_elements) return fem_body(setup.cells);
  sim::BodyDescription body{.name = "block"};
  if (setup.body == BodyKind::rigid) {
    sim::RigidModel rigid{.density = kDensity};
    rigid.shapes.push_back({Pose{}, sim::Box{0.5 * kSize}});
    body.model = rigid;
    return body;
  }
  auto set = example_set(setup, workshop);
  if (!set) return std::unexpected(set.error());
  sim::ExampleModel example{.set = std::make_shared<sim::example_based::ExampleSet>(std::move(*set)), .mass = kDensity * kSize.prod()};
  example.parameters = {.alpha = setup.alpha, .beta = 0, .gamma = 0.8, .lambda = 0.9};
  body.model = example;
  return body;
}

}  // namespace

Measure dent() {
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto ref = reference(workshop);
            if (!ref) return std::unexpected(ref.error());
            auto body = body_of(setup, workshop);
            if (!body) return std::unexpected(body.error());
            auto struck = strike(*body, setup);
            if (!struck) return std::unexpected(struck.error());
            struck->sample.values["error"] = relative_l2(flat(struck->u), ref->u);
            struck->sample.values["floor"] = ref->floor;
            return struck->sample;
          },
          // Every body kind is struck the same way; what differs is the knob.
          [](const Setup&, Workshop& workshop) -> Result<std::uint64_t> {
            sim::SceneDescription scene{.name = "dent", .gravity = Vec3::Zero()};
            scene.bodies.push_back(fem_body(finest(workshop)));
            return scene_hash(scene);
          }};
}

}  // namespace crumple::lab::chart
