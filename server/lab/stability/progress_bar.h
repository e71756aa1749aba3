#pragma once

#include <string>

namespace crumple::lab::stability {

// A bar with the time left, on standard error: redrawn on a terminal, else a line every half minute.
class ProgressBar {
 public:
  explicit ProgressBar(double total);  // in any unit of work
  void show(const std::string& what);  // what is being done
  void advance(double work);
  void finish();

 private:
  std::string time_left() const;
  bool terminal_;
  double total_, done_ = 0, start_, last_line_;
};

}  // namespace crumple::lab::stability
