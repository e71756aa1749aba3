#pragma once

#include "server/authoring/prescored_parts.h"
#include "server/authoring/scoring.h"
#include "server/rig/broken_scene.h"
#include "server/rig/make_command.h"

#include <tuple>

namespace crumple::rig {

// Breaks an asset into parts, each an asset of its own, and a scene that joins them (Jones et al. 2016, section 5).
struct BreakCommand {
  std::string by = "voronoi", scene, picture;
  std::vector<std::tuple<double, double, double, double>> planes;
  std::vector<double> grain, block;
  bool unstruck = false;
  authoring::ScoreOptions score;
  authoring::PrescoringOptions prescoring;
  BrokenSceneOptions options;
  MakeCommand make;

  void add_to(CLI::App& app);

  int run();
};

}  // namespace crumple::rig
