#include "common/text.h"
#include "server/authoring/shapes/node_sets.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"
#include "server/lab/enclosed_case.h"
#include "server/lab/static_solve.h"
#include "server/lab/vibration_modes.h"
#include "server/sim/fem/corotational.h"
#include "server/sim/fem/elements.h"
#include "server/sim/fem/rotation.h"
#include "server/sim/state_hash.h"

#include <cmath>

namespace crumple::lab::chart {
namespace {

constexpr const char* kCantilever = "S03_cantilever_small";
constexpr double kPointYoung = 1e6, kPointPoisson = 0.3;  // of the material point [Pa], [-]

struct Cantilever {
  Level level;
  Material material{1e7, 0.3, 1000};
  int probe = 0;  // the node at (1, 0.05, 0.05)
};

// 1 x 0.1 x 0.1 m, held at x = 0, pulled down at x = 1 by 0.25 N of uniform traction: S03 on any lattice.
Result<Cantilever> cantilever(const Setup& setup) {
  const int n = setup.cells;
  auto mesh = authoring::box_mesh({.size = {1, 0.1, 0.1}, .cells = {5 * n, n, n}, .lattice = setup.lattice, .minimum = Vec3::Zero()});
  if (!mesh) return std::unexpected(mesh.error());
  Cantilever made;
  made.material.element = setup.element;
  made.level.mesh = std::move(*mesh);
  const std::vector<Vec3>& X = made.level.mesh.X;
  for (int node : authoring::nodes_on_side(X, authoring::Side::min_x)) {
    for (int dof = 0; dof < 3; ++dof) made.level.dirichlet.push_back({node, dof, 0});
  }
  made.level.loads = Eigen::VectorXd::Zero(3 * X.size());
  constexpr double kTraction = 0.25 / (0.1 * 0.1);  // [Pa]
  for (const sim::SurfaceFace& face : sim::surface_faces(made.level.mesh.tets)) {
    const Vec3 a = X[face.nodes[0]], b = X[face.nodes[1]], c = X[face.nodes[2]];
    if (std::min({a.x(), b.x(), c.x()}) < 1 - 1e-9) continue;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    for (int node : face.nodes) made.level.loads[3 * node + 2] -= kTraction * area / 3;
  }
  const Vec3 target(1, 0.05, 0.05);
  for (std::size_t k = 0; k < X.size(); ++k) {
    if ((X[k] - target).norm() < (X[made.probe] - target).norm()) made.probe = static_cast<int>(k);
  }
  return made;
}

Result<std::uint64_t> cantilever_hash(const Setup& setup, Workshop&) {
  auto made = cantilever(setup);
  if (!made) return std::unexpected(made.error());
  return level_hash(made->level, made->material);
}

struct Timed {
  StaticSolution solution;
  double seconds;
};

Result<Timed> solve(const Level& level, const Material& material, Model model, Precision precision) {
  const double from = now_seconds();
  auto solution = solve_static(level, material, model, precision);
  if (!solution) return std::unexpected(solution.error());
  return Timed{std::move(*solution), now_seconds() - from};
}

std::vector<double> flat(std::span<const Vec3> rows) {
  std::vector<double> out;
  for (const Vec3& r : rows) out.insert(out.end(), r.data(), r.data() + 3);
  return out;
}

Sample to_sample(const Timed& timed) {
  Sample sample;
  sample.values = {{"seconds", timed.seconds}, {"iterations", timed.solution.iterations}, {"residual", timed.solution.residual}};
  if (!timed.solution.converged) sample.failure = text("not converged, residual ", timed.solution.residual);
  return sample;
}

// ---- stored cases ------------------------------------------------------------------------------------------------

struct Stored {
  Level level;
  Material material;
  Json level_json, scalars;
  Vec3 gravity;  // [m/s^2]; zero: the case names none
};

Result<Stored> stored(const Setup& setup, const Workshop& workshop) {
  const auto folder = workshop.yardstick / setup.case_name;
  MaterialOverride override;
  if (setup.poisson > 0) override.poisson = setup.poisson;
  override.element = setup.element;
  auto level = read_level(folder, setup.level);
  if (!level) return std::unexpected(level.error());
  auto material = read_material(folder, override);
  if (!material) return std::unexpected(material.error());
  auto level_json = read_json(folder / (setup.level + ".json"));
  if (!level_json) return std::unexpected(level_json.error());
  auto case_json = read_json(folder / "case.json");
  if (!case_json) return std::unexpected(case_json.error());
  const Json& g = (*case_json)["gravity"];
  return Stored{std::move(*level), *material, std::move(*level_json), (*case_json)["scalars"],
                g.is_array() ? Vec3(g[0], g[1], g[2]) : Vec3::Zero()};
}

Result<std::uint64_t> stored_hash(const Setup& setup, Workshop& workshop) {
  auto read = stored(setup, workshop);
  if (!read) return std::unexpected(read.error());
  if (setup.enclosing == 0) return level_hash(read->level, read->material);
  const auto enclosed = enclose(read->level, read->gravity, read->material.density, setup.enclosing);
  if (!enclosed) return std::unexpected(enclosed.error());
  return level_hash(enclosed->level, read->material);
}

std::vector<double> field_of(const Stored& read, const std::string& field) {
  std::vector<double> values;
  for (const Json& row : read.level_json["solutions"][field]) {
    for (int c = 0; c < 3; ++c) values.push_back(row[c].get<double>());
  }
  return values;
}

double field_error(const Stored& read, std::span<const Vec3> displacements, const std::string& field) {
  return relative_l2(flat(displacements), field_of(read, field));
}

// By how much the case's reference differs from one that is coarser.
double floor_of_bunny(const Stored& read) { return read.scalars["c3d10_L0_vs_L1_relL2"]; }

Result<Sample> hung_in_a_lattice(const Stored& read, const Setup& setup) {
  const auto enclosed = enclose(read.level, read.gravity, read.material.density, setup.enclosing);
  if (!enclosed) return std::unexpected(enclosed.error());
  auto timed = solve(enclosed->level, read.material, Model::linear, setup.precision);
  if (!timed) return std::unexpected(timed.error());
  Sample sample = to_sample(*timed);
  sample.values["error"] = field_error(read, enclosed->carried(timed->solution.displacements), setup.field);
  sample.values["floor"] = floor_of_bunny(read);
  sample.values["tets"] = enclosed->level.mesh.tet_count();
  return sample;
}

// sqrt((u - r) K (u - r) / r K r) with this mesh's K at rest: what a stress is off by, where the L2 norm is about places.
Result<double> energy_error(const Stored& read, const StaticSolution& solution, const std::string& field) {
  auto rest = rest_body(read.level, read.material);
  if (!rest) return std::unexpected(rest.error());
  const std::vector<Mat3> unstrained(rest->point_count(), Mat3::Zero());
  const auto K = sim::fem::tangent_stiffness(*rest, read.level.mesh.tets, read.level.mesh.X, unstrained, sim::fem::Tangent::fixed_rotation);
  const std::vector<double> u = flat(solution.displacements), reference = field_of(read, field);
  const Eigen::Map<const Eigen::VectorXd> r(reference.data(), static_cast<Eigen::Index>(reference.size()));
  const Eigen::VectorXd d = Eigen::Map<const Eigen::VectorXd>(u.data(), static_cast<Eigen::Index>(u.size())) - r;
  return std::sqrt(d.dot(K * d) / r.dot(K * r));
}

int nearest(const std::vector<Vec3>& X, const Vec3& target) {
  int best = 0;
  for (std::size_t k = 0; k < X.size(); ++k) {
    if ((X[k] - target).norm() < (X[best] - target).norm()) best = static_cast<int>(k);
  }
  return best;
}

struct Probe {
  double got, reference, before;  // `before`: what the reference was on its next coarser mesh
};

// A number of a case instead of a field, named in the set-up's `field`.
Probe probe(const Stored& read, const StaticSolution& solution, const Setup& setup) {
  const Json& s = read.scalars;
  const std::vector<Vec3>& X = read.level.mesh.X;
  if (setup.field == "elastica tip") {
    return {solution.displacements[nearest(X, {1, 0.05, 0.05})].z(), s["c3d10_nlgeom_20x4x4"][2], s["c3d10_nlgeom_20x2x2"][2]};
  }
  if (setup.field == "torque") {
    double torque = 0;
    for (std::size_t n = 0; n < X.size(); ++n) {
      if (X[n].x() > 1 - 1e-9) torque += (X[n] - Vec3(0, 0.1, 0.1)).cross(solution.reactions[n]).x();
    }
    return {torque, s["st_venant_torque"], s["c3d10_10x8x8"]};
  }
  const std::string nu = text("_nu", setup.poisson);
  return {solution.displacements[nearest(X, {48, 60, 0})].y(), s["c3d10_32" + nu], s["c3d10_16" + nu]};
}

Result<Sample> first_frequency(const Stored& read) {
  const double from = now_seconds();
  auto hz = natural_frequencies(read.level, read.material, 1);
  if (!hz) return std::unexpected(hz.error());
  const double fine = read.scalars["ccx_c3d10_32x3x4_Hz"][0], coarse = read.scalars["ccx_c3d10_16x2x2_Hz"][0];
  return Sample{{{"seconds", now_seconds() - from}, {"error", std::abs((*hz)[0] - fine) / fine}, {"floor", std::abs(fine - coarse) / fine}}, ""};
}

// P of St. Venant-Kirchhoff: F (lambda tr(G) I + 2 mu G), G = (F^T F - I) / 2.
Mat3 stvk(const sim::fem::Lame& lame, const Mat3& F) {
  const Mat3 G = 0.5 * (F.transpose() * F - Mat3::Identity());
  return F * sim::fem::isotropic_stress(lame, G);
}

Measure law_gap(std::function<Mat3(double)> gradient) {
  return {[=](const Setup& setup, Workshop&) -> Result<Sample> {
            const sim::fem::Lame lame = sim::fem::lame_constants(kPointYoung, kPointPoisson);
            const Mat3 F = gradient(setup.strain);
            const Mat3 Q = sim::fem::rotation(F, setup.rotation);
            const Mat3 other = stvk(lame, F);
            const Mat3 gap = sim::fem::first_piola(lame, Q, F, Mat3::Zero()) - other;
            return Sample{{{"error", gap.norm() / other.norm()}}, ""};
          },
          [](const Setup&, Workshop&) -> Result<std::uint64_t> {
            sim::StateHash hash;  // nothing but the material
            hash.add(kPointYoung);
            hash.add(kPointPoisson);
            return hash.value();
          }};
}

}  // namespace

Measure cantilever_on_lattices() {
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto made = cantilever(setup);
            if (!made) return std::unexpected(made.error());
            double reference = -0.0010078, floor = 0.01;  // Timoshenko's beam: the clamp is not in it
            if (workshop.has(kCantilever)) {
              auto json = read_json(workshop.yardstick / kCantilever / "case.json");
              if (!json) return std::unexpected(json.error());
              const Json& s = (*json)["scalars"];
              reference = s["c3d10_32x6x6"];
              floor = std::abs(1 - s["c3d10_20x4x4"].get<double>() / reference);
            }
            auto timed = solve(made->level, made->material, Model::linear, setup.precision);
            if (!timed) return std::unexpected(timed.error());
            Sample sample = to_sample(*timed);
            sample.values["error"] = std::abs(timed->solution.displacements[made->probe].z() - reference) / std::abs(reference);
            sample.values["floor"] = floor;
            sample.values["tets"] = static_cast<double>(made->level.mesh.tets.size());
            return sample;
          },
          cantilever_hash};
}

Measure static_precision() {
  return {[](const Setup& setup, Workshop&) -> Result<Sample> {
            auto made = cantilever(setup);
            if (!made) return std::unexpected(made.error());
            auto exact = solve(made->level, made->material, Model::linear, Precision::double_);
            if (!exact) return std::unexpected(exact.error());
            auto timed = solve(made->level, made->material, Model::linear, setup.precision);
            if (!timed) return std::unexpected(timed.error());
            Sample sample = to_sample(*timed);
            sample.values["error"] = relative_l2(flat(timed->solution.displacements), flat(exact->solution.displacements));
            return sample;
          },
          cantilever_hash};
}

Measure stored_case() {
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto read = stored(setup, workshop);
            if (!read) return std::unexpected(read.error());
            if (setup.field == "first frequency") return first_frequency(*read);
            const Model model = setup.field == "elastica tip" ? Model::corotational : Model::linear;
            if (setup.enclosing > 0) return hung_in_a_lattice(*read, setup);
            auto timed = solve(read->level, read->material, model, setup.precision);
            if (!timed) return std::unexpected(timed.error());
            Sample sample = to_sample(*timed);
            if (read->level_json["solutions"].contains(setup.field)) {
              sample.values["error"] = field_error(*read, timed->solution.displacements, setup.field);
              if (model == Model::linear) {
                auto energy = energy_error(*read, timed->solution, setup.field);
                if (!energy) return std::unexpected(energy.error());
                sample.values["error_energy"] = *energy;
              }
              sample.values["floor"] = setup.case_name.starts_with("S09") ? floor_of_bunny(*read) : 0;
            } else {
              const Probe p = probe(*read, timed->solution, setup);
              sample.values["error"] = std::abs((p.got - p.reference) / p.reference);
              sample.values["floor"] = std::abs((p.before - p.reference) / p.reference);
            }
            return sample;
          },
          stored_hash};
}

Measure law_gap_of_case() {
  return {[](const Setup& setup, Workshop& workshop) -> Result<Sample> {
            auto read = stored(setup, workshop);
            if (!read) return std::unexpected(read.error());
            auto timed = solve(read->level, read->material, Model::corotational, setup.precision);
            if (!timed) return std::unexpected(timed.error());
            Sample sample = to_sample(*timed);
            sample.values["error"] = field_error(*read, timed->solution.displacements, setup.field);
            return sample;
          },
          stored_hash};
}

Measure law_gap_in_shear() {
  return law_gap([](double gamma) {
    Mat3 F = Mat3::Identity();
    F(0, 1) = gamma;
    return F;
  });
}

Measure law_gap_in_stretch() {
  return law_gap([](double strain) {
    Mat3 F = Mat3::Identity();
    F(0, 0) += strain;
    return F;
  });
}

}  // namespace crumple::lab::chart
