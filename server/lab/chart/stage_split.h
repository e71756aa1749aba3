#pragma once

#include "server/lab/chart/point.h"

namespace crumple::sim {
class World;
}

namespace crumple::lab::chart {

// Where a step's time goes, in four parts: assemble, solve, contact (detection) and the rest of the stages.
class StageSplit {
 public:
  // The world tells its stages' times from now on.
  explicit StageSplit(sim::World& world);
  void add();  // after each step
  // ms_assemble, ms_solve, ms_contact, ms_other: means over the steps [ms].
  void report(Sample& sample) const;

 private:
  sim::World& world_;
  double assemble_ = 0, solve_ = 0, contact_ = 0, other_ = 0;  // [ms]
  int steps_ = 0;
};

}  // namespace crumple::lab::chart
