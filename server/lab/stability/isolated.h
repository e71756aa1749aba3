#pragma once

#include <functional>
#include <string>

namespace crumple::lab::stability {

struct Isolated {
  bool finished = false;  // false: it crashed or ran out of time
  std::string answer;     // what `work` returned
  std::string ending;     // "signal 11", "no answer within 300 s"
  double seconds = 0;     // wall time
};

// Runs `work` in a process of its own, so that a check that crashes is an outcome. Call it while the program has one
// thread only.
Isolated run_isolated(const std::function<std::string()>& work, int limit_seconds = 300);

}  // namespace crumple::lab::stability
