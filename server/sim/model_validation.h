#pragma once

#include "server/sim/scene.h"

#include <set>
#include <string>

// The part of validate(SceneDescription) that looks at one body's model.
namespace crumple::sim {

// Meshes and sets that bodies share are looked at once.
struct SeenAssets {
  std::set<const void*> valid;
};

// `field` is the body's path with the model's name, e.g. bodies[1].fem.
Result<void> validate(const RigidModel& model, const std::string& field, SeenAssets& seen);
Result<void> validate(const FemModel& model, const std::string& field, SeenAssets& seen);
Result<void> validate(const ExampleModel& model, const std::string& field, SeenAssets& seen);

// Tets that stand for the body: of its mesh, its set or its proxy. The model is complete.
std::int64_t tet_count(const BodyDescription& body);

}  // namespace crumple::sim
