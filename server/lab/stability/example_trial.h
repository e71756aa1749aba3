#pragma once

#include "server/lab/stability/method.h"
#include "server/sim/example_based/deform.h"

namespace crumple::lab::stability {

// A bar of 0.6 x 0.6 x 1.6 m and 100 kg with three bones along z, and `poses` behind the rest pose.
using Pose3 = std::array<sim::example_based::BoneTransform, 3>;
std::shared_ptr<sim::example_based::ExampleSet> bar_set(const std::vector<Pose3>& poses);
// Squashed, bent, dented on a side.
std::vector<Pose3> usual_poses();
Pose3 end_turned(double degrees);  // the upper end by this angle about x

// One example-based shape that takes impulses; where it is does not matter here.
class ExampleTrial {
 public:
  ExampleTrial(std::shared_ptr<const sim::example_based::ExampleSet> set, const ExampleMethod& method);

  // One step; impulses at the surface vertices nearest to the points.
  void step(std::span<const sim::example_based::VertexImpulse> impulses);
  int random_vertex(double uniform) const;  // of the surface, by a number in [0, 1)

  double simplex_error() const;  // of E's rows; infinite where an entry is outside [0, 1]
  bool finite() const;
  int inverted() const;          // tets of the skin
  int intersections() const;     // pairs of the surface's triangles that cut each other
  double shortest_edge() const;  // of the mesh [m]

  ExampleMethod method;
  sim::example_based::ExampleRest rest;
  sim::example_based::ExampleParameters parameters;  // alpha in the unit of the method's equation, of like effect
  sim::example_based::ExampleState state;
  sim::example_based::ExampleWorkspace work;
  sim::example_based::StepTimes times;
  sim::ThreadPool pool{1};
  double mass = 100;     // [kg]
  double last_move = 0;  // largest move of a vertex in the last step [m]
};

// 100 impacts of |j| [N s] on random surface vertices, then a second of rest.
struct Battered {
  bool finite = true;
  double simplex_error = 0;
  int inverted = 0, intersections = 0;
  double jump = 0;       // largest move of a vertex in one step [m]
  double last_move = 0;  // in the last step of the rest [m]
};
Battered batter(ExampleTrial& trial, double impulse, int impacts);

}  // namespace crumple::lab::stability
