#include "server/lab/material_replay.h"

#include "common/text.h"
#include "server/sim/fem/corotational.h"
#include "server/sim/fem/plasticity.h"
#include "server/sim/fem/rotation.h"

#include <cmath>

namespace crumple::lab {
namespace {

using sim::fem::Lame;

// Collects got and ref of one array.
class ArrayError {
 public:
  explicit ArrayError(double floor) : scale_(floor) {}
  void add(double got, double ref) {
    difference_ = std::max(difference_, std::isfinite(got) ? std::abs(got - ref) : std::numeric_limits<double>::infinity());
    scale_ = std::max(scale_, std::abs(ref));
  }
  double value() const { return difference_ / scale_; }

 private:
  double difference_ = 0, scale_;
};

Result<Mat3> matrix(const Json& value, const std::string& field) {
  if (!value.is_array() || value.size() != 3) return invalid(field, "must be a 3 x 3 matrix");
  Mat3 m;
  for (int r = 0; r < 3; ++r) {
    if (!value[r].is_array() || value[r].size() != 3) return invalid(field, "must be a 3 x 3 matrix");
    for (int c = 0; c < 3; ++c) {
      if (!value[r][c].is_number()) return invalid(field, "must hold numbers");
      m(r, c) = value[r][c].get<double>();
    }
  }
  return m;
}

void add(ArrayError& error, const Mat3& got, const Mat3& ref) {
  for (int i = 0; i < 9; ++i) error.add(got(i), ref(i));
}

// xx, yy, zz, xy of a row; all other components are zero.
Result<Mat3> row_matrix(const Json& row, const std::string& field) {
  if (!row.is_array() || row.size() != 4) return invalid(field, "must be [xx, yy, zz, xy]");
  Mat3 m = Mat3::Zero();
  for (int k = 0; k < 4; ++k) {
    if (!row[k].is_number()) return invalid(field, "must hold numbers");
    const double v = row[k].get<double>();
    if (k < 3) m(k, k) = v;
    else m(0, 1) = m(1, 0) = v;
  }
  return m;
}

Result<ReplayReport> replay_states(const Json& states, const Lame& lame, double young) {
  if (!states.is_array()) return invalid("states.json", "must be a list");
  ReplayReport report;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Json& state = states[i];
    if (!state.is_object()) return invalid(text("states.json[", i, "]"), "must be an object");
    const Json energy_ref = state.value("corot_energy_density", Json());
    if (!energy_ref.is_number()) return invalid(text("states.json[", i, "].corot_energy_density"), "must be a number");
    const auto read = [&](const char* name) { return matrix(state.value(name, Json()), text("states.json[", i, "].", name)); };
    const auto F = read("F"), Q_ref = read("Q"), strain_ref = read("corot_strain"), stress_ref = read("corot_stress"), P_ref = read("corot_P");
    for (const auto* m : {&F, &Q_ref, &strain_ref, &stress_ref, &P_ref}) {
      if (!*m) return std::unexpected(m->error());
    }
    const Mat3 Q = sim::fem::rotation(*F, sim::fem::RotationRule::svd);
    const Mat3 strain = sim::fem::corotational_strain(Q, *F);
    ArrayError rotation(1), strains(1e-3), stresses(1e-3 * young), piola(1e-3 * young), energy(1e-6 * young);
    add(rotation, Q, *Q_ref);
    add(strains, strain, *strain_ref);
    add(stresses, sim::fem::isotropic_stress(lame, strain), *stress_ref);
    add(piola, sim::fem::first_piola(lame, Q, *F, Mat3::Zero()), *P_ref);
    energy.add(sim::fem::energy_density(lame, strain), energy_ref.get<double>());
    double worst = 0;
    for (const ArrayError* e : {&rotation, &strains, &stresses, &piola, &energy}) worst = std::max(worst, e->value());
    const Json kind = state.value("state", Json("state"));
    const std::string name = text(kind.is_string() ? kind.get<std::string>() : kind.dump(), " ", state.value("param", Json()).dump());
    report.by_test[name] = worst;
    report.max_relative_error = std::max(report.max_relative_error, worst);
  }
  return report;
}

Result<ReplayReport> replay_paths(const Json& paths, const Lame& lame, double young) {
  const auto parameter = [&](const char* name) { return paths.contains(name) && paths[name].is_number() ? paths[name].get<double>() : std::nan(""); };
  const double yield = parameter("yield_"), creep = parameter("creep_per_update"), max_plastic = parameter("max_plastic");
  if (!(std::isfinite(yield) && std::isfinite(creep) && std::isfinite(max_plastic))) {
    return invalid("paths.json", "must give yield_, creep_per_update and max_plastic");
  }
  if (!paths.contains("tests") || !paths["tests"].is_object()) return invalid("paths.json", "must have tests by name");
  ReplayReport report;
  for (const auto& [name, test] : paths["tests"].items()) {
    const std::string at = "paths.json: tests." + name;
    for (const char* list : {"strain", "plastic", "stress"}) {
      if (!test.contains(list) || !test[list].is_array() || test[list].size() != test["strain"].size()) {
        return invalid(text(at, ".", list), "must be a list as long as strain");
      }
    }
    ArrayError plastic_error(1e-3), stress_error(1e-3 * young);
    Mat3 plastic = Mat3::Zero();
    for (std::size_t k = 0; k < test["strain"].size(); ++k) {
      const auto strain = row_matrix(test["strain"][k], at), plastic_ref = row_matrix(test["plastic"][k], at), stress_ref = row_matrix(test["stress"][k], at);
      for (const auto* m : {&strain, &plastic_ref, &stress_ref}) {
        if (!*m) return std::unexpected(m->error());
      }
      sim::fem::flow(sim::fem::FlowRule::additive, *strain, yield, creep, max_plastic, plastic);
      add(plastic_error, plastic, *plastic_ref);
      add(stress_error, sim::fem::isotropic_stress(lame, *strain - plastic), *stress_ref);
    }
    report.by_test[name] = std::max(plastic_error.value(), stress_error.value());
    report.max_relative_error = std::max(report.max_relative_error, report.by_test[name]);
  }
  return report;
}

// Shear stress at the ends of the legs of a cycle in pure shear [Pa]: to `amplitude`, to minus it and so on, in equal
// steps of total flow (c = 1).
std::vector<double> cycle_in_shear(sim::fem::FlowRule rule, const Lame& lame, double yield, double amplitude, int legs) {
  constexpr int kSteps = 100;  // a leg
  std::vector<double> tau;
  Mat3 plastic = Mat3::Zero();
  double from = 0;
  for (int leg = 0; leg < legs; ++leg) {
    const double to = leg % 2 == 0 ? amplitude : -amplitude;
    Mat3 strain = Mat3::Zero();
    for (int k = 1; k <= kSteps; ++k) {
      strain(0, 1) = strain(1, 0) = from + (to - from) * k / kSteps;
      sim::fem::flow(rule, strain, yield, 1, std::numeric_limits<double>::infinity(), plastic);
    }
    tau.push_back(sim::fem::isotropic_stress(lame, strain - plastic)(0, 1));
    from = to;
  }
  return tau;
}

Result<void> check_j2(const Json& check, const Lame& lame, double yield, ReplayReport& report) {
  const auto list = [&](const char* name) -> Result<std::vector<double>> {
    const std::string field = text("case.json: scalars.j2_check_pure_shear_c1.", name);
    if (!check.contains(name) || !check[name].is_array() || check[name].empty()) return invalid(field, "must be a list");
    for (const Json& value : check[name])
      if (!value.is_number()) return invalid(field, "must hold numbers");
    return check[name].get<std::vector<double>>();
  };
  const auto exact = list("additive_tau"), calculix = list("ccx_tau");
  for (const auto* l : {&exact, &calculix})
    if (!*l) return std::unexpected(l->error());
  if (exact->size() != calculix->size()) return invalid("case.json: scalars.j2_check_pure_shear_c1", "has lists of two lengths");
  const int legs = static_cast<int>(exact->size());
  const double amplitude = 10 * yield;
  for (const auto& [name, rule] : {std::pair{"j2_check additive", sim::fem::FlowRule::additive},
                                   std::pair{"j2_check deviatoric", sim::fem::FlowRule::deviatoric}}) {
    const std::vector<double> tau = cycle_in_shear(rule, lame, yield, amplitude, legs);
    ArrayError error(1e-3), to_calculix(1e-3);
    for (int k = 0; k < legs; ++k) {
      error.add(tau[k], (*exact)[k]);
      to_calculix.add(tau[k], (*calculix)[k]);
    }
    report.by_test[name] = error.value();
    report.max_relative_error = std::max(report.max_relative_error, error.value());
    report.j2_calculix = to_calculix.value();  // of the last, the deviatoric rule
  }
  return {};
}

}  // namespace

Result<ReplayReport> replay_material(const std::filesystem::path& case_dir) {
  const bool is_path = std::filesystem::exists(case_dir / "paths.json");
  if (!is_path && !std::filesystem::exists(case_dir / "states.json")) {
    return invalid(case_dir.string(), "has neither paths.json nor states.json");
  }
  auto data = read_json(case_dir / (is_path ? "paths.json" : "states.json"));
  if (!data) return std::unexpected(data.error());
  // A path file carries its own E and nu; states are of the case's material.
  MaterialOverride own;
  if (is_path && data->is_object() && data->contains("E") && (*data)["E"].is_number()) own.young = (*data)["E"].get<double>();
  if (is_path && data->is_object() && data->contains("nu") && (*data)["nu"].is_number()) own.poisson = (*data)["nu"].get<double>();
  auto material = read_material(case_dir, own);
  if (!material) return std::unexpected(material.error());
  const Lame lame = sim::fem::lame_constants(material->young, material->poisson);
  if (!is_path) return replay_states(*data, lame, material->young);
  auto report = replay_paths(*data, lame, material->young);
  const auto description = read_json(case_dir / "case.json");
  if (!report || !description) return report;
  const Json::json_pointer check("/scalars/j2_check_pure_shear_c1");
  if (!description->contains(check)) return report;
  if (auto ok = check_j2((*description)[check], lame, (*data)["yield_"].get<double>(), *report); !ok)
    return std::unexpected(ok.error());
  return report;
}

}  // namespace crumple::lab
