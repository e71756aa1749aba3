#pragma once

#include "server/authoring/rig_pipeline.h"
#include "server/rig/rig_command.h"

namespace crumple::rig {

// What makes an asset of a mesh.
struct MakeCommand {
  std::string mesh, handles, joints = "points", poses, crushed = "auto", weights = "auto";
  authoring::RigOptions options;
  bool turn_only = false;

  void add_to(CLI::App& app);

  Result<authoring::RiggedAsset> make(ProgressBar& progress);

  // `mesh` as an asset, read where it is one, else made; its summary goes into `result`. without_crushed: no crushed
  // sides unless they are asked for.
  Result<sim::example_based::ExampleSet> read_or_make(ProgressBar& progress, bool without_crushed,
                                                      nlohmann::json& result);

  int run(const RigOutputs& outputs);
};

}  // namespace crumple::rig
