#include "server/sim/fem/rest_body.h"

#include "common/text.h"
#include "server/sim/fem/smoothed_octahedron.h"
#include "server/sim/mesh/keep.h"

#include <cassert>
#include <cmath>
#include <numeric>
#include <sstream>

namespace crumple::sim::fem {

namespace {

constexpr double kDefaultClamp = 20;  // times 1 / mean edge

std::unexpected<Error> out_of_range(const std::string& field, const char* name, double value, const char* rule) {
  std::ostringstream text;
  text << "is " << value << ", must be " << rule;
  return invalid(field + "." + name, text.str());
}

double mean_edge_length(const TetMesh& mesh) {
  double sum = 0;
  for (const Tet& tet : mesh.tets)
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) sum += (mesh.X[tet[a]] - mesh.X[tet[b]]).norm();
  return sum / (6.0 * mesh.tet_count());
}

void append(RestBody& rest, const RestTet& tet) {
  if (tet.clamped && rest.beta_clamped.empty()) {  // the first
    rest.beta_clamped = rest.beta;
    rest.rest_gradient.assign(rest.beta.size(), Mat3::Identity());
  }
  if (tet.clamped || !rest.beta_clamped.empty()) {
    rest.beta_clamped.push_back(tet.beta_clamped);
    rest.rest_gradient.push_back(tet.rest_gradient);
  }
  rest.beta.push_back(tet.beta);
  rest.volume.push_back(tet.volume);
  rest.fill.push_back(tet.fill);
}

void add_regions(std::span<const MaterialRegion> regions, RestBody& rest) {
  if (regions.empty()) return;
  rest.material_id.assign(rest.tet_count(), 0);
  for (const MaterialRegion& region : regions) {
    const FemMaterial& m = region.material;
    rest.others.push_back({m, lame_constants(m.young, m.poisson)});
    for (const int t : region.tets) rest.material_id[t] = static_cast<std::uint16_t>(rest.others.size());
  }
}

template <class Predicate>
bool any_material(const RestBody& rest, Predicate holds) {
  return holds(rest.material) ||
         std::ranges::any_of(rest.others, [&](const RestBody::Other& other) { return holds(other.material); });
}

// What elements keep of lambda where patches have the rest (pressure_patch.h).
void leave_to_patches(const FemMaterial& material, Lame& lame) {
  if (material.poisson > kNearlyIncompressible) lame.lambda = lame.mu;
}

void update_node_mass(RestBody& rest, const std::vector<Tet>& tets, int node_count) {
  assert(static_cast<int>(tets.size()) == rest.tet_count());
  rest.node_mass.assign(node_count, 0.0);
  for (int t = 0; t < rest.tet_count(); ++t)
    for (int i : tets[t]) rest.node_mass[i] += 0.25 * rest.tet_mass(t);
  rest.node_drag.clear();
  if (!rest.heterogeneous()) return;
  rest.node_drag.assign(node_count, 0.0);
  for (int t = 0; t < rest.tet_count(); ++t)
    for (int i : tets[t]) rest.node_drag[i] += 0.25 * rest.tet_mass(t) * rest.material_of(t).damping_mass;
}

}  // namespace

Result<void> validate(const FemMaterial& m, const std::string& field) {
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!(m.young > 0 && m.young <= kMaxYoung)) return out_of_range(field, "young", m.young, "in (0, 1e13] Pa");
  if (!(m.poisson >= 0 && m.poisson < 0.5)) return out_of_range(field, "poisson", m.poisson, "in [0, 0.5)");
  if (!(m.density > 0 && m.density <= kMaxDensity))
    return out_of_range(field, "density", m.density, "in (0, 1e7] kg/m^3");
  if (!within(m.damping_mass, 0, kMaxDamping))
    return out_of_range(field, "damping_mass", m.damping_mass, "in [0, 1e6] 1/s");
  if (!within(m.damping_stiffness, 0, kMaxDamping))
    return out_of_range(field, "damping_stiffness", m.damping_stiffness, "in [0, 1e6] s");
  if (!(m.yield >= 0)) return out_of_range(field, "yield", m.yield, "at least 0");
  if (!within(m.creep, 0, 1)) return out_of_range(field, "creep", m.creep, "in [0, 1]");
  if (!within(m.max_plastic, 0, 1e6)) return out_of_range(field, "max_plastic", m.max_plastic, "in [0, 1e6]");
  if (!(m.toughness >= 0)) return out_of_range(field, "toughness", m.toughness, "at least 0");
  if (m.fracture_interval < 1) return out_of_range(field, "fracture_interval", m.fracture_interval, "at least 1");
  if (m.max_splits_per_step < 0) return out_of_range(field, "max_splits_per_step", m.max_splits_per_step, "at least 0");
  if (!within(m.friction, 0, 100)) return out_of_range(field, "friction", m.friction, "in [0, 100]");
  if (!(m.cg_tolerance > 0 && m.cg_tolerance < 1))
    return out_of_range(field, "cg_tolerance", m.cg_tolerance, "in (0, 1)");
  if (m.cg_max_iterations < 1 || m.cg_max_iterations > 1'000'000)
    return out_of_range(field, "cg_max_iterations", m.cg_max_iterations, "in [1, 1000000]");
  return {};
}

bool RestBody::yields() const {
  return any_material(*this, [](const FemMaterial& m) { return std::isfinite(m.yield); });
}

bool RestBody::dusty() const {
  return any_material(*this, [](const FemMaterial& m) { return m.dust > 0; });
}

bool RestBody::breakable() const {
  return any_material(*this, [](const FemMaterial& m) { return m.breakable; });
}

double RestBody::patch_lambda(int id) const {
  const FemMaterial& m = material_at(id);
  return lame_constants(m.young, m.poisson).lambda - (id == 0 ? lame : others[id - 1].lame).lambda;
}

double RestBody::mass() const { return std::accumulate(node_mass.begin(), node_mass.end(), 0.0); }

Mat34 RestBody::core(int t) const {
  return std::sqrt(fill[t] / (9 * volume[t])) * area_weighted_normals(beta_clamped.empty() ? beta[t] : beta_clamped[t], volume[t]);
}

Mat34 RestBody::gradients(int t) const {
  Mat34 g;
  g.rightCols<3>() = beta[t].transpose();
  g.col(0) = -g.rightCols<3>().rowwise().sum();
  return g;
}

RestTet RestBody::tet(int t) const {
  RestTet tet;
  tet.beta = beta[t];
  tet.clamped = clamped(t);
  tet.beta_clamped = tet.clamped ? beta_clamped[t] : beta[t];
  if (tet.clamped) tet.rest_gradient = rest_gradient[t];
  tet.normals = area_weighted_normals(tet.beta_clamped, volume[t]);
  tet.volume = volume[t];
  tet.fill = fill[t];
  return tet;
}

Result<RestBody> make_rest_body(const TetMesh& mesh, const FemMaterial& material, double clamp_limit,
                                std::span<const MaterialRegion> regions, ElementKind element) {
  if (auto ok = validate(mesh, "mesh"); !ok) return std::unexpected(ok.error());
  if (auto ok = validate(material, "material"); !ok) return std::unexpected(ok.error());
  if (auto ok = validate(regions, material, mesh.tet_count(), "regions"); !ok) return std::unexpected(ok.error());
  for (std::size_t r = 0; r < regions.size(); ++r)
    if (auto ok = validate(regions[r].material, text("regions[", r, "].material")); !ok)
      return std::unexpected(ok.error());
  if (!(clamp_limit >= 0) || std::isinf(clamp_limit))
    return invalid("clamp_limit", "is " + std::to_string(clamp_limit) + ", must be finite and at least 0");

  RestBody rest;
  rest.material = material;
  rest.lame = lame_constants(material.young, material.poisson);
  rest.mean_edge = mean_edge_length(mesh);
  const double limit = clamp_limit > 0 ? clamp_limit : kDefaultClamp / rest.mean_edge;
  rest.beta.reserve(mesh.tet_count());
  rest.volume.reserve(mesh.tet_count());
  rest.fill.reserve(mesh.tet_count());
  for (int t = 0; t < mesh.tet_count(); ++t)
    append(rest, make_rest_tet(gather(mesh.X, mesh.tets[t]), limit, mesh.fill.empty() ? 1 : mesh.fill[t]));
  add_regions(regions, rest);
  update_node_mass(rest, mesh.tets, mesh.node_count());
  if (element == ElementKind::smoothed_octahedra) {
    for (int k = 0; k < rest.material_count(); ++k) leave_to_patches(rest.material_at(k), k == 0 ? rest.lame : rest.others[k - 1].lame);
    make_octahedra(mesh.tets, rest);
    make_patches(mesh.tets, rest);
  }
  if (element == ElementKind::hexahedra) {
    for (int k = 0; k < rest.material_count(); ++k) {
      const double yield = rest.material_at(k).yield;
      if (std::isfinite(yield))
        return invalid(k == 0 ? "material.yield" : text("regions[", k - 1, "].material.yield"),
                       text("is ", yield, ", must be infinite: hexahedra would see a bend yield too late"));
    }
    const int in_cells = 6 * make_cells(mesh.tets, rest);
    if (2 * in_cells < mesh.tet_count())
      return invalid("mesh", text("has ", in_cells, " of ", mesh.tet_count(),
                                  " tets in cells of six around a diagonal, must have half of them in some: a Kuhn lattice"));
  }
  return rest;
}

namespace {

// Of what has one entry a tet (elements, which have two, see to themselves).
void for_each_tet_array(auto&& look) {
  look([](auto& rest) -> auto& { return rest.material_id; });
  look([](auto& rest) -> auto& { return rest.beta; });
  look([](auto& rest) -> auto& { return rest.volume; });
  look([](auto& rest) -> auto& { return rest.fill; });
  look([](auto& rest) -> auto& { return rest.beta_clamped; });
  look([](auto& rest) -> auto& { return rest.rest_gradient; });
  look([](auto& rest) -> auto& { return rest.patches.of_tet; });
  look([](auto& rest) -> auto& { return rest.macros.pairing; });
  look([](auto& rest) -> auto& { return rest.macros.cells.corner; });
  look([](auto& rest) -> auto& { return rest.macros.cells.order; });
  look([](auto& rest) -> auto& { return rest.macros.cells.shape; });
}

std::vector<int> elements_of(const std::vector<int>& of_tet, std::span<const int> tets) {
  std::vector<int> part;
  if (of_tet.empty()) return part;
  part.reserve(2 * tets.size());
  for (const int t : tets) part.insert(part.end(), {of_tet[2 * t], of_tet[2 * t + 1]});
  return part;
}

}  // namespace

void keep_tets(RestBody& rest, std::span<const int> kept) {
  for_each_tet_array([&](auto of) { keep(of(rest), kept); });
  rest.macros.of_tet = elements_of(rest.macros.of_tet, kept);
}

RestBody part_of(const RestBody& rest, std::span<const int> tets) {
  RestBody part{.material = rest.material, .lame = rest.lame, .others = rest.others};
  for_each_tet_array([&](auto of) { of(part) = taken(of(rest), tets); });
  part.macros.of_tet = elements_of(rest.macros.of_tet, tets);
  part.macros.cells.shapes = rest.macros.cells.shapes;
  part.mean_edge = rest.mean_edge;
  return part;
}

std::vector<int> follow_topology(RestBody& rest, const std::vector<Tet>& tets, int node_count) {
  update_node_mass(rest, tets, node_count);
  regroup_patches(tets, rest);
  return regroup(tets, rest);
}

}  // namespace crumple::sim::fem
