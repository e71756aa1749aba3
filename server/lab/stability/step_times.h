#pragma once

#include <vector>

namespace crumple::lab::stability {

// PASS-0 of every row: no step takes more than three times the median one. Trials hand their steps' times in; a row
// reports the worst. It is reported and not judged: it depends on the machine, a verdict must not.
class StepTimes {
 public:
  // seconds: of processor time, a step each, of one run of one trial. Steps are compared with the run's median, or with
  // a millisecond where that is more: what is shorter than that nobody misses, and no clock measures well.
  void add(std::vector<double> seconds);

  double worst() const { return worst_; }  // slowest step over median; 0: no step was timed

 private:
  double worst_ = 0;
};

// Of this process [s]: what other programs take does not count.
double processor_time();

}  // namespace crumple::lab::stability
