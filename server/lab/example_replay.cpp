#include "server/lab/example_replay.h"

#include "common/text.h"
#include "server/sim/example_based/deform.h"
#include "server/sim/example_based/deformed_mass.h"
#include "server/sim/example_based/impulse_projection.h"
#include "server/sim/example_based/skinning.h"
#include "server/sim/limits.h"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <limits>

namespace crumple::lab {
namespace {

using namespace sim::example_based;

// Reads numbers and keeps the first that is missing or wrong.
class Reader {
 public:
  const Json& list(const Json& at, const std::string& field, std::size_t size = 0) {
    static const Json kNothing = Json::array();
    if (!at.is_array() || (size > 0 && at.size() != size)) {
      breach.require(false, field, size > 0 ? text("must be a list of ", size) : "must be a list");
      return kNothing;
    }
    return at;
  }
  const Json& member(const Json& at, const char* name, const std::string& field) {
    static const Json kNothing;
    if (at.is_object() && at.contains(name)) return at[name];
    breach.require(false, field + "." + name, "is missing");
    return kNothing;
  }
  double number(const Json& at, const std::string& field, const sim::Range& range = {}) {
    if (!at.is_number()) {
      breach.require(false, field, "must be a number");
      return 0;
    }
    const double value = at.get<double>();
    breach.number(value, range, field);
    return value;
  }
  int index(const Json& at, const std::string& field, std::size_t below) {
    const bool fits = at.is_number_integer() && at.get<std::int64_t>() >= 0 && at.get<std::int64_t>() < static_cast<std::int64_t>(below);
    breach.require(fits, field, text("must be an index below ", below));
    return fits ? at.get<int>() : 0;
  }
  template <int n>
  Eigen::Matrix<double, n, 1> vector(const Json& at, const std::string& field) {
    Eigen::Matrix<double, n, 1> v = Eigen::Matrix<double, n, 1>::Zero();
    const Json& numbers = list(at, field, n);
    for (std::size_t k = 0; k < numbers.size(); ++k) v[static_cast<int>(k)] = number(numbers[k], text(field, "[", k, "]"));
    return v;
  }

  sim::FirstBreach breach;
};

std::shared_ptr<ExampleSet> read_set(const Json& in, Reader& read) {
  auto set = std::make_shared<ExampleSet>();
  const Json& u = read.list(read.member(in, "u", "inputs"), "inputs.u");
  for (std::size_t i = 0; i < u.size(); ++i) set->mesh.X.push_back(read.vector<3>(u[i], text("inputs.u[", i, "]")));
  const Json& tets = read.list(read.member(in, "tets", "inputs"), "inputs.tets");
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const std::string field = text("inputs.tets[", t, "]");
    const Json& corners = read.list(tets[t], field, 4);
    Tet tet{};
    for (std::size_t k = 0; k < corners.size(); ++k) tet[k] = read.index(corners[k], text(field, "[", k, "]"), u.size());
    set->mesh.tets.push_back(tet);
  }
  const Json& W = read.list(read.member(in, "W", "inputs"), "inputs.W", u.size());
  const std::size_t bones = !W.empty() && W[0].is_array() ? W[0].size() : 0;
  set->W = Eigen::MatrixXd::Zero(static_cast<int>(W.size()), static_cast<int>(bones));
  for (std::size_t i = 0; i < W.size(); ++i) {
    const Json& row = read.list(W[i], text("inputs.W[", i, "]"), bones);
    for (std::size_t b = 0; b < row.size(); ++b) set->W(static_cast<int>(i), static_cast<int>(b)) = read.number(row[b], text("inputs.W[", i, "][", b, "]"));
  }
  const Json& examples = read.list(read.member(in, "examples", "inputs"), "inputs.examples");
  for (std::size_t e = 0; e < examples.size(); ++e) {
    const std::string field = text("inputs.examples[", e, "]");
    const Json& t = read.list(read.member(examples[e], "t", field), field + ".t", bones);
    const Json& q = read.list(read.member(examples[e], "q_xyzw", field), field + ".q_xyzw", bones);
    Example& example = set->examples.emplace_back();
    if (examples[e].is_object() && examples[e].contains("name") && examples[e]["name"].is_string()) example.name = examples[e]["name"];
    for (std::size_t b = 0; b < std::min(t.size(), q.size()); ++b) {
      const Eigen::Vector4d xyzw = read.vector<4>(q[b], text(field, ".q_xyzw[", b, "]"));
      example.bones.push_back({Quat(xyzw[3], xyzw[0], xyzw[1], xyzw[2]), read.vector<3>(t[b], text(field, ".t[", b, "]"))});
    }
  }
  set->convex_parts.push_back({0, 1, 2, 3});  // nothing collides
  return set;
}

ExampleParameters read_parameters(const Json& in, Reader& read) {
  namespace limits = sim::limits;
  const auto number = [&](const char* name, const sim::Range& range) {
    return read.number(read.member(in, name, "inputs"), std::string("inputs.") + name, range);
  };
  ExampleParameters p;
  p.alpha = number("alpha", limits::kAlpha);
  p.beta = number("beta", limits::kBeta);
  p.gamma = number("gamma", limits::kGamma);
  p.lambda = number("lambda", limits::kLambda);
  p.mu = number("mu", limits::kRestitutionRate);
  p.nu = number("nu", limits::kRestitutionRate);
  p.restitution = number("Cr_star", limits::kUnit);
  p.raw_rates = true;
  return p;
}

Json json_of(const Eigen::MatrixXd& M) {
  Json rows = Json::array();
  for (int i = 0; i < M.rows(); ++i) rows.push_back(std::vector<double>(M.row(i).begin(), M.row(i).end()));
  return rows;
}
Json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json impulse_json(const ExampleRest& rest, const ExampleParameters& p, const ExampleState& state, double dt, double mass,
                  const VertexImpulse& at) {
  const Vec3 dx = plastic_displacement(at.impulse, projection_dt(p, dt, dt), mass, p.beta);
  const Jacobian J = skinning_jacobian(rest, at.vertex, state.E.row(at.vertex).transpose());
  const WeightRow de = weight_change(p, J, dx), Jt_dx = J.transpose() * dx;
  GeodesicSearch search;
  std::vector<double> distance(rest.vertex_count(), -1);
  for (const Reached& r : search.run(rest.graph, at.vertex, std::numeric_limits<double>::infinity())) distance[r.vertex] = r.distance;
  return {{"v", at.vertex}, {"dx", json_of(dx)}, {"J", json_of(Eigen::MatrixXd(J))}, {"Jt_dx", std::vector<double>(Jt_dx.begin(), Jt_dx.end())},
          {"Jt_dx_norm", Jt_dx.norm()}, {"de", std::vector<double>(de.begin(), de.end())},
          {"n_inside_kernel", search.run(rest.graph, at.vertex, p.gamma).size()}, {"geo_dist", distance}};
}

Json frame_json(const ExampleRest& rest, const ExampleParameters& p, double dt, double mass, const std::vector<VertexImpulse>& impulses,
                ExampleState& state, ExampleWorkspace& work) {
  const sim::ThreadPool pool(1);
  const StepTimes times{.dt = dt, .rate_dt = dt};
  Json frame{{"impulses", Json::array()}};
  for (const VertexImpulse& at : impulses) frame["impulses"].push_back(impulse_json(rest, p, state, dt, mass, at));
  accumulate(rest, p, times, mass, impulses, pool, state, work);
  frame["dE_accumulated"] = json_of(Eigen::MatrixXd(state.dE));
  release(rest, p, times, pool, state, work);
  frame["dE_frobenius"] = work.report.dE_frobenius;
  frame["Cr"] = state.restitution;
  frame["E"] = json_of(Eigen::MatrixXd(state.E));
  frame["x"] = Json::array();
  for (const Vec3& x : state.x) frame["x"].push_back(json_of(x));
  const DeformedMass lumped = lumped_mass(rest, state.x, mass), spread = deformed_mass(rest, state.x, mass);
  frame["com"] = json_of(lumped.com);
  frame["inertia"] = json_of(Eigen::MatrixXd(lumped.inertia));
  frame["principal_moments"] = json_of(Vec3(lumped.inertia.selfadjointView<Eigen::Upper>().eigenvalues()));
  frame["com_tet"] = json_of(spread.com);
  frame["inertia_tet"] = json_of(Eigen::MatrixXd(spread.inertia));
  frame["n_inverted_tets"] = inverted_tets(rest, state.x);
  return frame;
}

// Vertices whose Jacobian after a frame the case's own outputs have; none where it has no outputs.
std::vector<int> sampled_vertices(const Json& whole, std::size_t frame, int count) {
  std::vector<int> vertices;
  const Json::json_pointer path(text("/outputs/frames/", frame, "/J_after_sample"));
  if (!whole.contains(path) || !whole[path].is_array()) return vertices;
  for (const Json& sample : whole[path]) {
    if (!sample.is_object() || !sample.contains("v") || !sample["v"].is_number_integer()) continue;
    if (const auto v = sample["v"].get<std::int64_t>(); v >= 0 && v < count) vertices.push_back(static_cast<int>(v));
  }
  return vertices;
}

}  // namespace

Result<Json> replay_example(const std::filesystem::path& case_json) {
  const auto whole = read_json(case_json);
  if (!whole) return std::unexpected(whole.error());
  Reader read;
  const Json& in = read.member(*whole, "inputs", "case");
  const auto set = read_set(in, read);
  const ExampleParameters p = read_parameters(in, read);
  const double dt = read.number(read.member(in, "dt", "inputs"), "inputs.dt", sim::limits::kTimeStep);
  const double density = read.number(read.member(in, "density", "inputs"), "inputs.density", sim::limits::kDensity);
  std::vector<std::vector<VertexImpulse>> frames;
  const Json& given = read.list(read.member(in, "frames", "inputs"), "inputs.frames");
  for (std::size_t f = 0; f < given.size(); ++f) {
    const std::string field = text("inputs.frames[", f, "]");
    const Json& impulses = read.list(read.member(given[f], "impulses", field), field + ".impulses");
    frames.emplace_back();
    for (std::size_t k = 0; k < impulses.size(); ++k) {
      const std::string at = text(field, ".impulses[", k, "]");
      frames.back().push_back({read.index(read.member(impulses[k], "v", at), at + ".v", set->mesh.X.size()),
                               read.vector<3>(read.member(impulses[k], "j", at), at + ".j")});
    }
  }
  if (read.breach.ok()) read.breach.take(validate(*set, "inputs"));
  if (auto valid = read.breach.result(); !valid) return std::unexpected(valid.error());

  const ExampleRest rest = make_rest(set);
  const double mass = density * rest.volume;
  ExampleState state = make_state(rest, p);
  ExampleWorkspace work;
  Json out{{"mass", mass}, {"sign_be", Json::array()}, {"vertex_mass", Json::array()}, {"frames", Json::array()}};
  for (int e = 0; e < rest.example_count(); ++e) {
    out["sign_be"].push_back(Json::array());
    for (int b = 0; b < rest.bone_count(); ++b) out["sign_be"][static_cast<std::size_t>(e)].push_back(static_cast<int>(rest.sign[b * rest.example_count() + e]));
  }
  for (double share : rest.vertex_share) out["vertex_mass"].push_back(mass * share);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    Json& frame = out["frames"].emplace_back(frame_json(rest, p, dt, mass, frames[f], state, work));
    for (const int v : sampled_vertices(*whole, f, rest.vertex_count())) {
      const Jacobian J = skinning_jacobian(rest, v, state.E.row(v).transpose());
      frame["J_after_sample"].push_back({{"v", v}, {"J", json_of(Eigen::MatrixXd(J))}});
    }
  }
  return Json{{"outputs", std::move(out)}};
}

}  // namespace crumple::lab
