#pragma once

#include "server/rig/crush.h"
#include "server/rig/make_command.h"

namespace crumple::rig {

struct CrushCommand {
  std::vector<std::string> sides{"+x"};
  std::string name;
  CrushOptions options;
  bool shell = false;
  MakeCommand make;

  void add_to(CLI::App& app);

  int run(RigOutputs outputs);
};

}  // namespace crumple::rig
