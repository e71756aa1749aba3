#pragma once

#include "server/rig/rig_outputs.h"

#include <CLI/CLI.hpp>

// What the commands of crumple-rig have in common.
namespace crumple::rig {

// Prints an error, its field as the option that sets it, with the file that was read unless it is named already.
// Returns the exit code: 2 for bad input, 1 for anything else.
int fail(Error error, const std::string& file = "");

// "[######..............] fitting dented", redrawn in place on a terminal; on anything else, nothing.
class ProgressBar {
 public:
  ProgressBar();
  void show(double done, const std::string& stage);

 private:
  bool terminal_;
};

void add_outputs(CLI::App& app, RigOutputs& outputs, const std::string& of_asset);

// An asset file that holds an example set.
Result<sim::example_based::ExampleSet> read_set(const std::string& file);

// Whether a file is an asset of crumple-rig by its ending, not a mesh.
bool is_asset(const std::string& file);

}  // namespace crumple::rig
