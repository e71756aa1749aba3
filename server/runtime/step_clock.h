#pragma once

namespace crumple::runtime {

// When a playing world takes its next step of fixed length, and how fast it really runs. Knows no thread and no clock:
// the caller brings wall times [s].
//
// A world that is late takes its steps without waiting. What it owes beyond max_owed is dropped, so that a slow world
// runs slower than asked instead of ever further behind.
class StepClock {
 public:
  explicit StepClock(double dt, double max_owed = 0.1) : dt_(dt), max_owed_(max_owed) {}

  void play(double now, double speed = 1);  // the first step is due at once
  void pause();
  bool playing() const { return playing_; }
  double next_step_at() const { return due_; }  // wall time [s]; meaningful while playing
  void stepped(double now);                     // a step ended

  double real_time_factor() const;              // simulated over wall time, smoothed over 1 s; 0 when paused
  double dropped_seconds() const { return dropped_; }  // wall time given up since play

 private:
  double dt_, max_owed_;
  bool playing_ = false;
  double speed_ = 1;
  double due_ = 0;
  double last_ = 0;                         // end of the last step, or start of play
  double simulated_ = 0, elapsed_ = 0;      // exponentially forgetting sums [s]
  double dropped_ = 0;
};

}  // namespace crumple::runtime
