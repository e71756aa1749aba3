#pragma once

#include "server/rig/rig_command.h"

namespace crumple::rig {

// Prints what is in an asset, and draws it.
struct ShowCommand {
  std::string asset, picture;

  void add_to(CLI::App& app);

  int run() const;
};

}  // namespace crumple::rig
