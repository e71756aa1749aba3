#include "server/scene_convert/example_convert.h"

#include "server/authoring/barrel_asset.h"
#include "server/authoring/car_asset.h"
#include "server/scene_convert/asset_convert.h"
#include "server/scene_convert/enclosing_convert.h"
#include "server/scene_convert/surface_convert.h"

namespace crumple::scene_convert {
namespace {

using sim::example_based::ExampleParameters;
using sim::example_based::ExampleSet;

constexpr sim::Range kBones{1, 256};
constexpr sim::Range kDepth{0, 0.6, true};
constexpr sim::Range kConvexParts{0, 64};

ExampleSet make_barrel(const v1::BarrelAsset& m, const std::string& field, Conversion& c) {
  authoring::BarrelAsset asset;
  asset.shape = to_barrel(m.shape(), field + ".shape", c);
  asset.cell_size = number_or(m.has_cell_size(), m.cell_size(), asset.cell_size, kCellSize, field + ".cell_size", c);
  return c.breach.ok() ? c.value(authoring::make_barrel_asset(asset), field) : ExampleSet();
}

ExampleSet make_car(const v1::CarAsset& m, const std::string& field, Conversion& c) {
  authoring::CarAsset asset;
  asset.shape = to_car(m.shape(), field + ".shape", c);
  asset.cell_size = number_or(m.has_cell_size(), m.cell_size(), asset.cell_size, kCellSize, field + ".cell_size", c);
  asset.flattened = m.flattened();
  return c.breach.ok() ? c.value(authoring::make_car_asset(asset), field) : ExampleSet();
}

authoring::RigWeights to_rig_weights(int weights, const std::string& field, Conversion& c) {
  switch (weights) {
    case v1::DefaultAsset::GAUSSIAN:
      return authoring::RigWeights::gaussian;
    case v1::DefaultAsset::BOUNDED_BIHARMONIC:
      return authoring::RigWeights::bounded_biharmonic;
    default:
      c.breach.require(false, field, "is " + std::to_string(weights) + ", must be GAUSSIAN or BOUNDED_BIHARMONIC");
  }
  return {};
}

ExampleSet make_default(const v1::DefaultAsset& m, const std::string& field, Conversion& c) {
  authoring::DefaultAssetOptions o;
  o.enclosing = to_enclosing(m, field, c);
  o.bones = static_cast<int>(number_or(m.has_bones(), m.bones(), o.bones, kBones, field + ".bones", c));
  o.depth = number_or(m.has_depth(), m.depth(), o.depth, kDepth, field + ".depth", c);
  o.convex_parts = static_cast<int>(
      number_or(m.has_convex_parts(), m.convex_parts(), o.convex_parts, kConvexParts, field + ".convex_parts", c));
  o.weights = to_rig_weights(m.weights(), field + ".weights", c);
  const auto surface = to_shared_surface(m.surface(), field + ".surface", c);
  return c.breach.ok() ? c.value(authoring::make_default_asset(*surface, o), field) : ExampleSet();
}

ExampleSet make_set(const v1::AssetSource& message, const std::string& field, Conversion& c) {
  using Source = v1::AssetSource;
  switch (message.source_case()) {
    case Source::kFile:
      return c.value(c.files.examples(message.file()), field + ".file");
    case Source::kBarrel:
      return make_barrel(message.barrel(), field + ".barrel", c);
    case Source::kCar:
      return make_car(message.car(), field + ".car", c);
    case Source::kDefaultRig:
      return make_default(message.default_rig(), field + ".default_rig", c);
    case Source::kInlineAsset:
      return c.value(to_example_set(message.inline_asset(), field + ".inline_asset"), "");
    case Source::SOURCE_NOT_SET:
      break;
  }
  c.breach.require(false, field, "has no source, must be one of file, barrel, car, default_rig, inline_asset");
  return {};
}

std::shared_ptr<const ExampleSet> to_shared_set(const v1::AssetSource& message, const std::string& field,
                                                Conversion& c) {
  if (!c.breach.ok()) return nullptr;
  std::shared_ptr<const ExampleSet>& shared = c.example_sets[message.SerializeAsString()];
  if (shared) return shared;
  ExampleSet set = make_set(message, field, c);
  return shared = c.breach.ok() ? std::make_shared<const ExampleSet>(std::move(set)) : nullptr;
}

ExampleParameters::Step to_step(int step, const std::string& field, Conversion& c) {
  switch (step) {
    case v1::ExampleParameters::EQUATION_8:
      return ExampleParameters::Step::equation8;
    case v1::ExampleParameters::EQUATION_9:
      return ExampleParameters::Step::equation9;
    case v1::ExampleParameters::EQUATION_10:
      return ExampleParameters::Step::equation10;
    default:
      c.breach.require(false, field, "is " + std::to_string(step) + ", must be EQUATION_8, EQUATION_9 or EQUATION_10");
  }
  return {};
}

ExampleParameters to_parameters(const v1::ExampleParameters& message, const std::string& field, Conversion& c) {
  ExampleParameters p;
  if (message.has_alpha()) p.alpha = message.alpha();
  if (message.has_beta()) p.beta = message.beta();
  if (message.has_gamma()) p.gamma = message.gamma();
  if (message.has_lambda()) p.lambda = message.lambda();
  if (message.has_mu()) p.mu = message.mu();
  if (message.has_nu()) p.nu = message.nu();
  if (message.has_restitution()) p.restitution = message.restitution();
  if (message.has_raw_rates()) p.raw_rates = message.raw_rates();
  p.step = to_step(message.step(), field + ".step", c);
  if (message.has_triangle_collision()) p.triangle_collision = message.triangle_collision();
  if (message.has_tet_collision()) p.tet_collision = message.tet_collision();
  p.secondary_goal = c.value(to_secondary_goal(message.secondary_goal(), field + ".secondary_goal"), "");
  if (message.has_goal_tolerance()) p.goal_tolerance = message.goal_tolerance();
  if (message.has_keep_volume()) p.keep_volume = message.keep_volume();
  if (message.has_fatigue_time()) p.fatigue_time = message.fatigue_time();
  return p;
}

}  // namespace

Result<ExampleParameters::SecondaryGoal> to_secondary_goal(int goal, const std::string& field) {
  switch (goal) {
    case v1::ExampleParameters::NO_GOAL:
      return ExampleParameters::SecondaryGoal::none;
    case v1::ExampleParameters::FEW_EXAMPLES:
      return ExampleParameters::SecondaryGoal::few_examples;
    case v1::ExampleParameters::SMOOTH_WEIGHTS:
      return ExampleParameters::SecondaryGoal::smooth_weights;
    default:
      return invalid(field, "is " + std::to_string(goal) + ", must be NO_GOAL, FEW_EXAMPLES or SMOOTH_WEIGHTS");
  }
}

sim::ExampleModel to_example_model(const v1::ExampleBody& message, const std::string& field, Conversion& c) {
  sim::ExampleModel model;
  model.parameters = to_parameters(message.parameters(), field + ".parameters", c);
  if (message.has_density()) model.density = message.density();
  if (message.has_mass()) model.mass = message.mass();
  if (message.has_friction()) model.friction = message.friction();
  model.set = to_shared_set(message.asset(), field + ".asset", c);
  return model;
}

}  // namespace crumple::scene_convert
