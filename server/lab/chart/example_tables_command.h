#pragma once

namespace CLI {
class App;
}

namespace crumple::lab::chart {

// Adds `tables` to crumple-lab; exit_code gets what it ends with.
void add_example_tables_command(CLI::App& app, int& exit_code);

}  // namespace crumple::lab::chart
