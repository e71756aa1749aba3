#include "server/lab/chart/stage_split.h"

#include "server/lab/chart/motion.h"
#include "server/sim/world.h"

#include <algorithm>

namespace crumple::lab::chart {

StageSplit::StageSplit(sim::World& world) : world_(world) {
  world.set_clock([] { return 1000 * now_seconds(); });
}

void StageSplit::add() {
  ++steps_;
  for (const sim::StageTime& stage : world_.stage_times()) {
    const std::string name = stage.name;
    double& part = name == "assemble" ? assemble_ : name == "solve" ? solve_ : name == "detect" ? contact_ : other_;
    part += stage.ms;
  }
}

void StageSplit::report(Sample& sample) const {
  const double n = std::max(1, steps_);
  sample.values["ms_assemble"] = assemble_ / n;
  sample.values["ms_solve"] = solve_ / n;
  sample.values["ms_contact"] = contact_ / n;
  sample.values["ms_other"] = other_ / n;
}

}  // namespace crumple::lab::chart
