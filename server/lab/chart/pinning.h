#pragma once

#include <string>

// Where and as what a measurement runs.
namespace crumple::lab::chart {

// Processors that this process may use now, >= 1.
int allowed_processors();

// Ties this thread, and threads started while it lives, to `count` of them, the last ones: the first serve interrupts
// more often. Where the system refuses, everything stays as it was and held() is false.
class Pinning {
 public:
  explicit Pinning(int count);
  ~Pinning();
  Pinning(const Pinning&) = delete;
  Pinning& operator=(const Pinning&) = delete;
  bool held() const { return held_; }

 private:
  bool held_ = false;
  unsigned long before_[16] = {};  // a cpu_set_t
};

std::string machine_name();   // processor and number of allowed ones
std::string compiler_name();  // compiler, version, build kind
std::string commit();         // of the sources when this was built; "+" if they were changed; "unknown" outside git

}  // namespace crumple::lab::chart
