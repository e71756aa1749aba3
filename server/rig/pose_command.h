#pragma once

#include "server/rig/rig_command.h"

#include <tuple>

namespace crumple::rig {

struct PoseCommand {
  std::string asset, name;
  std::vector<std::tuple<std::string, double, double, double>> moves, turns;
  bool hold = false;

  void add_to(CLI::App& app);

  int run(RigOutputs outputs) const;
};

}  // namespace crumple::rig
