#include "server/lab/stability/method.h"

#include "server/lab/stability/contact_trial.h"
#include "server/lab/stability/soft_integrators.h"
#include "server/sim/fem/rotation.h"

namespace crumple::lab::stability {
namespace {

using sim::fem::FemMaterial;
using Step = sim::example_based::ExampleParameters::Step;

Mat3 paper_rotation(const Mat3& F) { return sim::fem::rotation(F, sim::fem::RotationRule::polar_qr); }
Mat3 default_rotation(const Mat3& F) { return sim::fem::rotation(F, sim::fem::RotationRule::svd); }

FemMethod fem(Mat3 (*rotation)(const Mat3&), void (*choose)(FemMaterial&), decltype(FemMethod::step) step,
              bool iterates = true, bool float_matrix = false) {
  return {.rotation = rotation, .choose = choose, .float_matrix = float_matrix, .iterates = iterates, .step = step};
}

FemMethod by_bdf2(void (*choose)(FemMaterial&), bool iterates) {
  FemMethod method = fem(default_rotation, choose, bdf2, iterates);
  method.integrator = sim::Integrator::bdf2;
  return method;
}

FemMethod of_elements(sim::fem::ElementKind element) {
  FemMethod method = fem(default_rotation, nullptr, backward_euler);
  method.element = element;
  return method;
}
FemMethod of_octahedra() { return of_elements(sim::fem::ElementKind::smoothed_octahedra); }

std::vector<Method> make_methods() {
  const auto tight = [](FemMaterial& m) {
    m.cg_tolerance = 1e-8;
    m.cg_max_iterations = 3000;
  };
  const auto paper_rule = [](FemMaterial& m) { m.rotation = sim::fem::RotationRule::polar_qr; };
  std::vector<Method> all;
  // -- finite elements: rotation rule, integrator, solver -----------------------------------------------------------
  all.push_back({.key = "svd",
                 .name = "SVD, backward Euler, block-Jacobi (default)",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = fem(default_rotation, nullptr, backward_euler)});
  all.push_back({.key = "svd-float",
                 .name = "the same, float matrix",
                 .family = Family::fem,
                 .fem = fem(default_rotation, nullptr, backward_euler, true, true)});
  all.push_back({.key = "svd-tight",
                 .name = "the same, CG to 1e-8",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = fem(default_rotation, tight, backward_euler, false)});
  all.push_back({.key = "svd-multigrid",
                 .name = "the same, multigrid (default where large and stiff)",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = fem(default_rotation, nullptr, backward_euler_multigrid)});
  all.back().fem.solver = sim::linear_solver::SolverKind::multigrid;
  all.push_back({.key = "bdf2",
                 .name = "SVD, BDF2, CG",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = by_bdf2(nullptr, true)});
  all.push_back({.key = "bdf2-tight",
                 .name = "the same, CG to 1e-8",
                 .family = Family::fem,
                 .fem = by_bdf2(tight, false)});
  all.push_back({.key = "octahedra",
                 .name = "smoothed octahedra, SVD, backward Euler, block-Jacobi",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = of_octahedra()});
  all.push_back({.key = "hexahedra",
                 .name = "hexahedra, SVD, backward Euler, block-Jacobi",
                 .family = Family::fem,
                 .mapped = true,
                 .fem = of_elements(sim::fem::ElementKind::hexahedra)});
  all.push_back({.key = "polar-qr",
                 .name = "polar, QR below 6 % of the volume",
                 .family = Family::fem,
                 .standing = Standing::paper,
                 .mapped = true,
                 .fem = fem(paper_rotation, paper_rule, backward_euler)});
  all.push_back({.key = "plain-polar",
                 .name = "plain polar, mirrored Q allowed",
                 .family = Family::fem,
                 .standing = Standing::comparison,
                 .fem = fem(plain_polar_rotation, nullptr, backward_euler_any_rotation, false)});
  all.push_back({.key = "direct",
                 .name = "SVD, backward Euler, direct solve",
                 .family = Family::fem,
                 .fem = fem(default_rotation, nullptr, backward_euler_direct, false)});
  all.back().fem.solver = sim::linear_solver::SolverKind::direct;
  all.push_back({.key = "explicit",
                 .name = "SVD, explicit (symplectic Euler)",
                 .family = Family::fem,
                 .standing = Standing::comparison,
                 .mapped = true,
                 .fem = fem(default_rotation, nullptr, symplectic_euler, false)});
  // -- contact
  // ----------------------------------------------------------------------------------------------------------
  all.push_back({.key = "recovery",
                 .name = "implicit rows with depth recovery (default)",
                 .family = Family::contact,
                 .mapped = true});
  all.push_back({.key = "recovery-300",
                 .name = "the same, kappa 300, tau 8 dt",
                 .family = Family::contact,
                 .contact = {.settings = {.kappa = 300, .recovery_steps = 8}}});
  all.push_back({.key = "guarded",
                 .name = "the default with the server's guard",
                 .family = Family::contact,
                 .contact = {.guarded = true}});
  all.push_back({.key = "recovery-bdf2",
                 .name = "implicit rows with depth recovery, BDF2",
                 .family = Family::contact,
                 .mapped = true,
                 .contact = {.integrator = sim::Integrator::bdf2}});
  all.push_back({.key = "recovery-octahedra",
                 .name = "implicit rows with depth recovery, smoothed octahedra",
                 .family = Family::contact,
                 .mapped = true,
                 .contact = {.element = sim::fem::ElementKind::smoothed_octahedra}});
  all.push_back({.key = "recovery-hexahedra",
                 .name = "implicit rows with depth recovery, hexahedra",
                 .family = Family::contact,
                 .contact = {.element = sim::fem::ElementKind::hexahedra}});
  all.push_back({.key = "raw-1e6",
                 .name = "raw damping, phi = 1e6",
                 .family = Family::contact,
                 .standing = Standing::paper,
                 .mapped = true,
                 .contact = {.settings = {.raw_damping = true, .phi = 1e6}}});
  all.push_back({.key = "raw-1e9",
                 .name = "raw damping, phi = 1e9",
                 .family = Family::contact,
                 .standing = Standing::paper,
                 .contact = {.settings = {.raw_damping = true, .phi = 1e9}}});
  all.push_back({.key = "penalty",
                 .name = "explicit penalty springs, no friction",
                 .family = Family::contact,
                 .standing = Standing::comparison,
                 .contact = {.settings = {.kappa = 0}, .push = push_by_penalty}});
  all.push_back({.key = "rigid",
                 .name = "rigid boxes (Bullet's solver)",
                 .family = Family::contact,
                 .mapped = true,
                 .contact = {.rigid = true}});
  // -- plasticity and fracture
  // ------------------------------------------------------------------------------------------
  all.push_back({.key = "creep", .name = "creep per second (default)", .family = Family::plasticity});
  all.push_back({.key = "deviatoric",
                 .name = "the same, deviatoric flow (J2)",
                 .family = Family::plasticity,
                 .flow = sim::fem::FlowRule::deviatoric});
  all.push_back({.key = "creep-bdf2",
                 .name = "creep per second, BDF2",
                 .family = Family::plasticity,
                 .fem = by_bdf2(nullptr, true)});
  all.push_back({.key = "creep-octahedra",
                 .name = "creep per second, smoothed octahedra",
                 .family = Family::plasticity,
                 .fem = of_octahedra()});
  all.push_back({.key = "raw-creep",
                 .name = "creep per update",
                 .family = Family::plasticity,
                 .standing = Standing::paper,
                 .raw = true});
  all.push_back({.key = "toughness", .name = "toughness in Pa (default)", .family = Family::fracture});
  all.push_back({.key = "toughness-bdf2",
                 .name = "toughness in Pa, BDF2",
                 .family = Family::fracture,
                 .fem = by_bdf2(nullptr, true)});
  all.push_back({.key = "toughness-octahedra",
                 .name = "toughness in Pa, smoothed octahedra",
                 .family = Family::fracture,
                 .fem = of_octahedra()});
  all.push_back({.key = "toughness-hexahedra",
                 .name = "toughness in Pa, hexahedra",
                 .family = Family::fracture,
                 .fem = of_elements(sim::fem::ElementKind::hexahedra)});
  all.push_back({.key = "raw-toughness",
                 .name = "toughness in newtons",
                 .family = Family::fracture,
                 .standing = Standing::paper,
                 .raw = true});
  // -- examples
  // -----------------------------------------------------------------------------------------------------------
  const auto example = [&](const char* key, const char* name, Standing standing, ExampleMethod method, bool mapped) {
    all.push_back({.key = key,
                   .name = name,
                   .family = Family::example,
                   .standing = standing,
                   .mapped = mapped,
                   .example = method});
  };
  example("eq8", "eq. 8, dt-free rates (default)", Standing::offered, {}, true);
  example("eq9", "eq. 9 with Tikhonov", Standing::offered, {Step::equation9}, false);
  example("eq10", "eq. 10", Standing::offered, {Step::equation10}, true);
  example("eq8-raw", "eq. 8, rates per step", Standing::paper, {Step::equation8, true}, true);
  example("eq9-raw", "eq. 9, thresholded pseudo-inverse", Standing::paper, {Step::equation9, true}, false);
  example("eq8-unaligned", "eq. 8, unaligned QLERP", Standing::comparison, {Step::equation8, false, false}, false);
  // -- collision shapes -----------------------------------------------------------------------------------------------
  all.push_back({.key = "convex", .name = "convex parts (default)", .family = Family::shape});
  all.push_back({.key = "triangles",
                 .name = "triangle mesh (GImpact)",
                 .family = Family::shape,
                 .standing = Standing::paper,
                 .triangles = true});
  // -- the core as it stands -----------------------------------------------------------------------------------------
  all.push_back({.key = "core", .name = "the core", .family = Family::world});
  return all;
}

}  // namespace

const std::vector<Method>& all_methods() {
  static const std::vector<Method> methods = make_methods();
  return methods;
}

std::vector<const Method*> methods_of(Family family) {
  std::vector<const Method*> list;
  for (const Method& method : all_methods())
    if (method.family == family) list.push_back(&method);
  return list;
}

const Method* find_method(const std::string& key) {
  for (const Method& method : all_methods())
    if (method.key == key) return &method;
  return nullptr;
}

Method Method::timed(StepTimes& to) const {
  Method method = *this;
  method.times = method.fem.times = method.contact.times = &to;
  return method;
}

const char* name_of(Standing standing) {
  constexpr const char* kNames[] = {"offered", "paper", "comparison"};
  return kNames[static_cast<int>(standing)];
}

}  // namespace crumple::lab::stability
