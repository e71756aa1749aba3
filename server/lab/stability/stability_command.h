#pragma once

#include <CLI/App.hpp>

namespace crumple::lab::stability {

// Adds `stability` to crumple-lab:
//   --out DIR [--only ROW]              all rows and maps into DIR; resumes after an interruption
//   --ci --baseline FILE                the regression part; exit 1 and the rows named where something fell behind
//   --out DIR --write-baseline FILE     a full run, and from it a new baseline
// exit_code: 0 done, 1 fell behind or could not write, 2 bad input.
void add_command(CLI::App& app, int& exit_code);

}  // namespace crumple::lab::stability
