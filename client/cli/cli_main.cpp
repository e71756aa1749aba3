// crumple: the command line client. See --help.
#include <csignal>
#include <iostream>

#include "client/cli/command_line.h"

namespace {
std::atomic<bool> stop = false;
static_assert(std::atomic<bool>::is_always_lock_free);  // set in a signal handler
}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
  return crumple::cli::run(argc, argv, std::cout, std::cerr, stop);
}
