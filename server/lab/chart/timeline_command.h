#pragma once

namespace CLI {
class App;
}

namespace crumple::lab::chart {

// Adds `timeline` to crumple-lab; exit_code gets what it ends with.
void add_timeline_command(CLI::App& app, int& exit_code);

}  // namespace crumple::lab::chart
