#include "server/scene_convert/fem_convert.h"

#include "server/scene_convert/motion_convert.h"
#include "server/scene_convert/region_convert.h"
#include "server/scene_convert/splinter_convert.h"
#include "server/scene_convert/surface_convert.h"
#include "server/scene_convert/tet_convert.h"

namespace crumple::scene_convert {
namespace {

sim::fem::ElementKind to_element(int element, const std::string& field, Conversion& c) {
  switch (element) {
    case v1::FemBody::LINEAR_TETRAHEDRA:
      return sim::fem::ElementKind::linear_tetrahedra;
    case v1::FemBody::SMOOTHED_OCTAHEDRA:
      return sim::fem::ElementKind::smoothed_octahedra;
    case v1::FemBody::HEXAHEDRA:
      return sim::fem::ElementKind::hexahedra;
    default:
      c.breach.require(false, field, "is " + std::to_string(element) + ", must be LINEAR_TETRAHEDRA, SMOOTHED_OCTAHEDRA or HEXAHEDRA");
  }
  return {};
}

sim::fem::RotationRule to_rotation_rule(int rule, const std::string& field, Conversion& c) {
  switch (rule) {
    case v1::FemMaterial::SVD:
      return sim::fem::RotationRule::svd;
    case v1::FemMaterial::POLAR_QR:
      return sim::fem::RotationRule::polar_qr;
    default:
      c.breach.require(false, field, "is " + std::to_string(rule) + ", must be SVD or POLAR_QR");
  }
  return {};
}

sim::fem::FlowRule to_flow_rule(int rule, const std::string& field, Conversion& c) {
  switch (rule) {
    case v1::FemMaterial::ADDITIVE:
      return sim::fem::FlowRule::additive;
    case v1::FemMaterial::DEVIATORIC:
      return sim::fem::FlowRule::deviatoric;
    default:
      c.breach.require(false, field, "is " + std::to_string(rule) + ", must be ADDITIVE or DEVIATORIC");
  }
  return {};
}

sim::fem::FractureOrder to_fracture_order(int order, const std::string& field, Conversion& c) {
  switch (order) {
    case v1::FemMaterial::RANDOM:
      return sim::fem::FractureOrder::random;
    case v1::FemMaterial::LARGEST_FIRST:
      return sim::fem::FractureOrder::largest_first;
    default:
      c.breach.require(false, field, "is " + std::to_string(order) + ", must be RANDOM or LARGEST_FIRST");
  }
  return {};
}

}  // namespace

sim::fem::FemMaterial to_material(const v1::FemMaterial& message, const std::string& field, Conversion& c) {
  sim::fem::FemMaterial m;
  if (message.has_young()) m.young = message.young();
  if (message.has_poisson_ratio()) m.poisson = message.poisson_ratio();
  if (message.has_density()) m.density = message.density();
  if (message.has_damping_mass()) m.damping_mass = message.damping_mass();
  if (message.has_damping_stiffness()) m.damping_stiffness = message.damping_stiffness();
  m.rotation = to_rotation_rule(message.rotation(), field + ".rotation", c);
  m.flow = to_flow_rule(message.flow(), field + ".flow", c);
  if (message.has_yield()) m.yield = message.yield();
  if (message.has_creep()) m.creep = message.creep();
  if (message.has_max_plastic()) m.max_plastic = message.max_plastic();
  if (message.has_raw_creep()) m.raw_creep = message.raw_creep();
  if (message.has_breakable()) m.breakable = message.breakable();
  if (message.has_toughness()) m.toughness = message.toughness();
  if (message.has_raw_toughness()) m.raw_toughness = message.raw_toughness();
  if (message.has_fracture_interval()) m.fracture_interval = message.fracture_interval();
  if (message.has_max_splits_per_step()) m.max_splits_per_step = message.max_splits_per_step();
  m.fracture_order = to_fracture_order(message.fracture_order(), field + ".fracture_order", c);
  if (message.has_dust()) m.dust = message.dust();
  if (message.has_friction()) m.friction = message.friction();
  if (message.has_cg_tolerance()) m.cg_tolerance = message.cg_tolerance();
  if (message.has_cg_max_iterations()) m.cg_max_iterations = message.cg_max_iterations();
  return m;
}

sim::FemModel to_fem(const v1::FemBody& message, const std::string& field, Conversion& c) {
  sim::FemModel model;
  model.material = to_material(message.material(), field + ".material", c);
  if (message.has_clamp_limit()) model.clamp_limit = message.clamp_limit();
  model.element = to_element(message.element(), field + ".element", c);
  if (message.has_rigid_fragments()) model.rigid_fragments = message.rigid_fragments();
  if (message.has_self_contact()) model.self_contact = message.self_contact();
  model.mesh = to_shared_tets(message.mesh(), field + ".mesh", c);
  if (c.breach.ok()) model.regions = to_regions(message.regions(), model.material, *model.mesh, field + ".regions", c);
  for (int i = 0; c.breach.ok() && i < message.motions_size(); ++i) {
    const v1::NodeMotion& motion = message.motions(i);
    const std::string path = entry(field + ".motions", i);
    model.motions.push_back(
        {to_nodes(motion.nodes(), *model.mesh, path + ".nodes", c), to_keys(motion.keys(), path + ".keys", c)});
  }
  if (message.has_render()) model.render = to_shared_surface(message.render(), field + ".render", c);
  if (c.breach.ok() && message.has_splinters()) model.splinters = to_shared_splinters(message, *model.mesh, model.render.get(), field, c);
  return model;
}

}  // namespace crumple::scene_convert
