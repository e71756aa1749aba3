#pragma once

#include "common/error.h"
#include "crumple/v1/scene.pb.h"
#include "server/scene_convert/mesh_source.h"
#include "server/sim/scene.h"

namespace crumple::scene_convert {

// A scene for the core, for files and calls alike; it has passed sim::validate. Meshes that the scene generates are
// made here, so that this may take seconds. The first breach is the error; its path is written as in scene.proto,
// such as `bodies[2].fem.material.poisson_ratio`. `recording` is checked, too.
Result<sim::SceneDescription> to_scene(const v1::Scene& message, const MeshSource& files);

}  // namespace crumple::scene_convert
