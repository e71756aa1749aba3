#pragma once

namespace CLI {
class App;
}

namespace crumple::lab::chart {

// Adds `chart` to crumple-lab. Exit codes as the program's: 0 done, 2 bad input, 1 anything else.
void add_chart_command(CLI::App& app, int& exit_code);

}  // namespace crumple::lab::chart
