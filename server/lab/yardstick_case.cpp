#include "server/lab/yardstick_case.h"

#include "common/text.h"

#include <cmath>
#include <fstream>

namespace crumple::lab {
namespace {

Result<double> number(const Json& value, const std::string& field) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return invalid(field, "must be a finite number");
  return value.get<double>();
}

Result<Vec3> vector(const Json& value, const std::string& field) {
  if (!value.is_array() || value.size() != 3) return invalid(field, "must be three numbers");
  Vec3 v;
  for (int k = 0; k < 3; ++k) {
    auto c = number(value[k], field);
    if (!c) return std::unexpected(c.error());
    v[k] = *c;
  }
  return v;
}

Result<int> index(const Json& value, int count, const std::string& field) {
  if (!value.is_number_integer()) return invalid(field, "must be a whole number");
  const auto i = value.get<std::int64_t>();
  if (i < 0 || i >= count) return invalid(field, text("is ", i, ", must be in [0, ", count, ")"));
  return static_cast<int>(i);
}

Result<std::vector<Vec3>> vectors(const Json& value, const std::string& field) {
  if (!value.is_array()) return invalid(field, "must be a list");
  std::vector<Vec3> list;
  for (std::size_t i = 0; i < value.size(); ++i) {
    auto v = vector(value[i], text(field, "[", i, "]"));
    if (!v) return std::unexpected(v.error());
    list.push_back(*v);
  }
  return list;
}

Result<void> read_tets(const Json& value, sim::TetMesh& mesh, const std::string& field) {
  if (!value.is_array()) return invalid(field, "must be a list");
  for (std::size_t t = 0; t < value.size(); ++t) {
    const std::string at = text(field, "[", t, "]");
    if (!value[t].is_array() || value[t].size() != 4) return invalid(at, "must be four node ids");
    Tet tet;
    for (int a = 0; a < 4; ++a) {
      auto n = index(value[t][a], mesh.node_count(), at);
      if (!n) return std::unexpected(n.error());
      tet[a] = *n;
    }
    mesh.tets.push_back(tet);
  }
  return {};
}

// A list that may be left out.
Result<Json> list(const Json& object, const char* name, const std::string& field) {
  if (!object.contains(name)) return Json::array();
  if (!object[name].is_array()) return invalid(text(field, name), "must be a list");
  return object[name];
}

Result<void> read_supports(const Json& json, Level& level, const std::string& file) {
  const auto dirichlet = list(json, "dirichlet", file + ": "), loads = list(json, "loads", file + ": ");
  if (!dirichlet) return std::unexpected(dirichlet.error());
  if (!loads) return std::unexpected(loads.error());
  for (std::size_t i = 0; i < dirichlet->size(); ++i) {
    const Json& row = (*dirichlet)[i];
    const std::string at = text(file, ": dirichlet[", i, "]");
    if (!row.is_array() || row.size() != 3) return invalid(at, "must be [node, dof, value]");
    auto node = index(row[0], level.mesh.node_count(), at);
    if (!node) return std::unexpected(node.error());
    auto dof = index(row[1], 3, at);
    if (!dof) return std::unexpected(dof.error());
    auto value = number(row[2], at);
    if (!value) return std::unexpected(value.error());
    level.dirichlet.push_back({*node, *dof, *value});
  }
  level.loads = Eigen::VectorXd::Zero(3 * level.mesh.node_count());
  for (std::size_t i = 0; i < loads->size(); ++i) {
    const Json& row = (*loads)[i];
    const std::string at = text(file, ": loads[", i, "]");
    if (!row.is_array() || row.size() != 4) return invalid(at, "must be [node, fx, fy, fz]");
    auto node = index(row[0], level.mesh.node_count(), at);
    if (!node) return std::unexpected(node.error());
    for (int k = 0; k < 3; ++k) {
      auto f = number(row[k + 1], at);
      if (!f) return std::unexpected(f.error());
      level.loads[3 * *node + k] += *f;
    }
  }
  return {};
}

}  // namespace

std::vector<char> Level::fixed_dofs() const {
  std::vector<char> fixed(3 * mesh.node_count(), 0);
  for (const Dirichlet& d : dirichlet) fixed[3 * d.node + d.dof] = 1;
  return fixed;
}

Result<Json> read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return std::unexpected(Error{ErrorCode::invalid_argument, file.string(), "cannot be read"});
  Json json = Json::parse(in, nullptr, false);
  if (json.is_discarded()) return invalid(file.string(), "is not JSON");
  return json;
}

Result<Level> read_level(const std::filesystem::path& case_dir, const std::string& name) {
  const std::string file = (case_dir / (name + ".json")).string();
  auto json = read_json(file);
  if (!json) return std::unexpected(json.error());
  if (!json->is_object()) return invalid(file, "must be a JSON object");
  for (const char* field : {"nodes", "tets"}) {
    if (!json->contains(field)) return invalid(file, text("has no ", field));
  }
  Level level;
  auto nodes = vectors((*json)["nodes"], file + ": nodes");
  if (!nodes) return std::unexpected(nodes.error());
  level.mesh.X = std::move(*nodes);
  if (auto read = read_tets((*json)["tets"], level.mesh, file + ": tets"); !read) return std::unexpected(read.error());
  if (auto read = read_supports(*json, level, file); !read) return std::unexpected(read.error());
  if (json->contains("initial_velocity")) {
    auto velocities = vectors((*json)["initial_velocity"], file + ": initial_velocity");
    if (!velocities) return std::unexpected(velocities.error());
    if (velocities->size() != level.mesh.X.size()) return invalid(file + ": initial_velocity", "must have one row a node");
    level.initial_velocity = std::move(*velocities);
  }
  if (json->contains("sets")) {
    const auto tips = list((*json)["sets"], "tip", file + ": sets.");
    if (!tips) return std::unexpected(tips.error());
    if (!tips->empty()) {
      auto tip = index((*tips)[0], level.mesh.node_count(), file + ": sets.tip[0]");
      if (!tip) return std::unexpected(tip.error());
      level.tip = *tip;
    }
  }
  if (auto valid = sim::validate(level.mesh, file + ": "); !valid) return std::unexpected(valid.error());
  return level;
}

Result<Material> read_material(const std::filesystem::path& case_dir, const MaterialOverride& override) {
  const std::string file = (case_dir / "case.json").string();
  auto json = read_json(file);
  if (!json) return std::unexpected(json.error());
  const Json m = json->contains("material") ? (*json)["material"] : Json();
  const auto read = [&](const char* name, const std::optional<double>& instead) -> Result<double> {
    if (instead) return *instead;
    const std::string field = text(file, ": material.", name);
    if (!m.contains(name)) return invalid(field, "is missing");
    if (m[name].is_array()) return invalid(field, "is a list; name one of its values on the command line");
    return number(m[name], field);
  };
  auto young = read("E", override.young);
  if (!young) return std::unexpected(young.error());
  auto poisson = read("nu", override.poisson);
  if (!poisson) return std::unexpected(poisson.error());
  auto density = read("rho", std::nullopt);
  if (!density) return std::unexpected(density.error());
  if (!(*young > 0 && *young <= sim::fem::kMaxYoung)) return invalid("E", text("is ", *young, ", must be in (0, 1e13]"));
  if (!(*poisson >= 0 && *poisson < 0.5)) return invalid("nu", text("is ", *poisson, ", must be in [0, 0.5)"));
  if (!(*density > 0 && *density <= sim::fem::kMaxDensity)) return invalid("rho", text("is ", *density, ", must be in (0, 1e7]"));
  return Material{*young, *poisson, *density, override.element};
}

Result<sim::fem::RestBody> rest_body(const Level& level, const Material& material) {
  constexpr double kNoClamp = 1e15;  // [1/m]
  sim::fem::FemMaterial m;
  m.young = material.young;
  m.poisson = material.poisson;
  m.density = material.density;
  return sim::fem::make_rest_body(level.mesh, m, kNoClamp, {}, material.element);
}

Result<Run> read_run(const std::filesystem::path& case_dir, const std::string& name) {
  const std::string file = (case_dir / "case.json").string();
  auto json = read_json(file);
  if (!json) return std::unexpected(json.error());
  const std::string field = text(file, ": runs.", name);
  if (!json->contains("runs") || !(*json)["runs"].contains(name)) return invalid(field, "is missing");
  const Json& r = (*json)["runs"][name];
  Run run;
  if (!r.contains("level") || !r["level"].is_string()) return invalid(field + ".level", "must be the name of a level");
  run.level = r["level"].get<std::string>();
  const std::string model = r.contains("model") && r["model"].is_string() ? r["model"].get<std::string>() : "";
  if (model != "linear" && model != "corotational") return invalid(field + ".model", "must be linear or corotational");
  run.corotational = model == "corotational";
  if (r.contains("loads")) {
    if (!r["loads"].is_boolean()) return invalid(field + ".loads", "must be true or false");
    run.loads = r["loads"].get<bool>();
  }
  if (r.contains("gravity")) {
    auto gravity = vector(r["gravity"], field + ".gravity");
    if (!gravity) return std::unexpected(gravity.error());
    run.gravity = *gravity;
  }
  if (!r.contains("end")) return invalid(field + ".end", "is missing");
  auto end = number(r["end"], field + ".end");
  if (!end) return std::unexpected(end.error());
  if (!(*end > 0 && *end <= 1e4)) return invalid(field + ".end", text("is ", *end, ", must be in (0, 1e4]"));
  run.end = *end;
  const auto snapshots = list(r, "snapshots", field + ".");
  if (!snapshots) return std::unexpected(snapshots.error());
  for (const Json& t : *snapshots) {
    auto time = number(t, field + ".snapshots");
    if (!time) return std::unexpected(time.error());
    run.snapshots.push_back(*time);
  }
  return run;
}

}  // namespace crumple::lab
