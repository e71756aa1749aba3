#include "server/lab/spacecraft_scenes.h"

#include "common/text.h"
#include "server/authoring/rig.h"
#include "server/authoring/shapes/spacecraft.h"
#include "server/lab/scene_builder.h"

#include <algorithm>
#include <initializer_list>
#include <string_view>

namespace crumple::lab {
namespace {

using authoring::Loft;
using sim::example_based::ExampleParameters;
using sim::example_based::ExampleSet;

// A default rig of a surface, with those of its examples that are named, and rest.
SharedSet asset(const sim::SurfaceMesh& surface, double cell_size, int bones, int convex_parts,
                std::initializer_list<std::string_view> examples) {
  ExampleSet set = *authoring::make_default_asset(
      surface, {.enclosing = {.cell_size = cell_size}, .bones = bones, .convex_parts = convex_parts});
  std::erase_if(set.examples, [&](const auto& e) { return e.name != "rest" && std::ranges::find(examples, e.name) == examples.end(); });
  return std::make_shared<const ExampleSet>(std::move(set));
}

SharedSet part(const Loft& loft, double cell_size, int bones, int convex_parts, std::initializer_list<std::string_view> examples) {
  return asset(authoring::loft_surface(loft), cell_size, bones, convex_parts, examples);
}

struct Fighter {
  SharedSet fuselage, wings[2];
};

// Theirs: N 1188, B 12, E 3; here in three parts of together as much.
Fighter fighter() {
  return {part(authoring::fighter_fuselage(), 0.73, 6, 3, {"crushed_max_x", "crushed_max_y"}),
          {part(authoring::fighter_wing(-1), 0.73, 3, 1, {"crushed_max_x", "crushed_min_z"}),
           part(authoring::fighter_wing(1), 0.73, 3, 1, {"crushed_max_x", "crushed_max_z"})}};
}

constexpr double kFuselageMass = 14e3, kWingMass = 3e3;  // [kg]

// Each wing by its root's leading and trailing edge.
void add_fighter(SceneBuilder& b, const std::string& name, const Fighter& set, const Pose& X_WF, const Vec3& velocity,
                 const ExampleParameters& metal) {
  const auto fuselage = static_cast<BodyId>(b.scene.bodies.size());
  const auto add = [&](const std::string& part_name, const SharedSet& part_set, double mass) {
    sim::BodyDescription& body = b.example(name + part_name, part_set, mass, X_WF.p_WB, metal);
    body.pose = X_WF;
    body.velocity = velocity;
  };
  add("", set.fuselage, kFuselageMass);
  for (const int k : {0, 1}) {
    add(k == 0 ? " left wing" : " right wing", set.wings[k], kWingMass);
    for (const double x : {-1.5, 1.5}) {
      Vec3 root = authoring::kWingRoot + Vec3(x, 0, 0);
      if (k == 0) root.z() *= -1;
      b.scene.joints.push_back({fuselage, fuselage + 1 + static_cast<BodyId>(k), X_WF * root, 1.5e6, 1.5e6});
    }
  }
}

}  // namespace

sim::SceneDescription space(std::uint64_t seed) {
  SceneBuilder b("space", 0.00412, seed);
  b.scene.gravity.setZero();
  b.scene.joint_time = 0;  // strengths are of one step's force
  const SharedSet ship = asset(authoring::large_ship(), 3.45, 64, 5, {"crushed_max_x", "crushed_min_y", "crushed_max_y", "crushed_min_z", "crushed_max_z"});
  b.example("ship", ship, 8e6, Vec3::Zero(), {.alpha = 3000, .beta = 2e4, .gamma = 12, .lambda = 0.95});
  const Fighter set = fighter();
  const ExampleParameters metal{.alpha = 30, .beta = 2e3, .gamma = 3, .lambda = 0.9};
  for (int k = 0; k < 17; ++k) {  // a wedge of five rows
    const int row = k < 1 ? 0 : k < 4 ? 1 : k < 8 ? 2 : k < 13 ? 3 : 4;
    const int first[] = {0, 1, 4, 8, 13}, count[] = {1, 3, 4, 5, 4};
    const double across = k - first[row] - (count[row] - 1) / 2.0;
    const Vec3 place(-8 + 20 * across + b.uniform(-1, 1), b.uniform(-3, 3), -70 - 22 * row);
    add_fighter(b, text("fighter ", k), set, {about(Vec3::UnitY(), -M_PI / 2 + b.uniform(-0.1, 0.1)), place}, {0, 0, 75}, metal);
  }
  return std::move(b.scene);
}

sim::SceneDescription shipyard(std::uint64_t seed) {
  SceneBuilder b("shipyard", 1.0 / 480, seed);
  b.scene.joint_time = 0;
  b.ground();
  const Vec3 flight(45, -1, 0);
  sim::BodyDescription& ship = b.example("ship", part(authoring::fighter_fuselage(), 0.5, 12, 4, {"crushed_max_x", "crushed_max_y"}), 30e3,
                                         {-45, 15, 0}, {.alpha = 30, .beta = 5e3, .gamma = 3, .lambda = 0.95});
  ship.velocity = flight;
  std::vector<SharedSet> sets;  // theirs, in one: N 1939, B 14, E 3
  const int bones[] = {3, 3, 2, 3, 3}, convex[] = {1, 1, 1, 2, 2};
  const std::vector<Loft> parts = authoring::crane_parts();
  for (std::size_t k = 0; k < parts.size(); ++k)
    sets.push_back(part(parts[k], 0.78, bones[k], convex[k], {"crushed_min_x", "crushed_min_z"}));
  constexpr double kAngle[] = {1.2, -1.4, 1.7};  // jibs keep clear of the other cranes
  constexpr double kMass[] = {8e3, 8e3, 5e3, 4e3, 7e3};
  for (int crane = 0; crane < 3; ++crane) {
    const Pose X_WC{about(Vec3::UnitY(), kAngle[crane]), {-12.0 + 16 * crane, 0, -1.5 + 1.5 * crane}};
    const auto mast = static_cast<BodyId>(b.scene.bodies.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
      b.example(text("crane ", crane, " part ", k), sets[k], kMass[k], Vec3::Zero(), {.alpha = 60, .beta = 2e3, .gamma = 2, .lambda = 0.95}).pose = X_WC;
      const BodyId under = k == 0 ? 0 : mast + static_cast<BodyId>(std::min<std::size_t>(k - 1, 2));
      b.scene.joints.push_back({mast + static_cast<BodyId>(k), under, X_WC * authoring::kCraneJoints[k], 1.2e6, 1.5e6});
    }
  }
  return std::move(b.scene);
}

}  // namespace crumple::lab
