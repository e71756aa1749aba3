#pragma once

#include <atomic>
#include <iosfwd>

namespace crumple::cli {

// Exit codes of `crumple`.
enum ExitCode {
  kOk = 0,           // also when watch or record end at their limit or by a signal
  kRefused = 1,      // the server answered with an error, which is printed
  kUsage = 2,        // bad options, or a local file that cannot be read or written
  kUnreachable = 3,  // no server answers, or it stopped meanwhile
};

// Runs one command line. Results go to `out`, errors to `err`. `stop` ends watch and record.
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err, const std::atomic<bool>& stop);

}  // namespace crumple::cli
