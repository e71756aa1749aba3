#pragma once

#include "server/authoring/deformed_shape.h"
#include "server/authoring/embedded_skinning.h"
#include "server/authoring/pose_field.h"
#include "server/authoring/pose_solver.h"
#include "server/authoring/surface_samples.h"

namespace crumple::authoring {

// An example given by some of its handles.
struct HandleMove {
  std::string handle;
  std::optional<Vec3> position;  // where the handle's point goes [m]; none: it stays
  std::optional<Quat> rotation;  // how it turns, of any length but 0; none: as the pose solver finds
};
struct NamedPose {
  std::string name;
  std::vector<HandleMove> moves;
};

// What the handles do that a pose does not name: what keeps the body as rigid as possible, or nothing.
enum class UnnamedHandles { free, held };

// Of copies (pose_from_shape.h) [-].
inline constexpr double kTurnPenalty = 0.01;

struct ExampleReport {
  std::string name;
  enum class Source { animation, copy, handles, crushed } source = Source::crushed;
  // From where a copy has the surface, or a crushed side the nodes, to where the pose puts them.
  double residual_rms = 0, residual_largest = 0;  // [m]
  double residual_relative = 0;                   // residual_rms, in parts of the displacement's own [-]
  double strain = 0;                              // that the pose solver left (PoseSolveReport)
  bool converged = true;                          // the fit, or the pose solver
};

// Makes examples of a set that has its mesh, W, handles and, for copies, render. What they share is made once, when it
// is first needed; only `examples` may change meanwhile. Each call adds one example and is an error where the set has
// no handles, the name is missing or taken, or there are 64 examples already.
class ExampleAuthor {
 public:
  explicit ExampleAuthor(sim::example_based::ExampleSet& set) : set_(set) {}

  // Of an animation: where the first handles go; any others are free (pose_solver.h).
  Result<ExampleReport> add_animation(const sim::example_based::Example& joints);

  // Moved handles, completed by the pose solver. Errors: no moves, a handle that is not there or moved twice,
  // positions or rotations out of range.
  Result<ExampleReport> add_pose(const NamedPose& pose, UnnamedHandles unnamed = UnnamedHandles::free);

  // The pose nearest to a deformed copy of the render surface (pose_from_shape.h, surface_samples.h). Errors: no
  // render surface, another number of vertices, vertices that are not finite.
  Result<ExampleReport> add_copy(const DeformedShape& copy);

  // A field that imitates a pose, fitted at the nodes by translations (pose_fit.h).
  Result<ExampleReport> add_field(const std::string& name, const PoseField& field);

 private:
  struct Drawn {  // the render surface as it is fitted to
    SurfaceSamples samples;
    std::vector<Vec3> rest;
    EmbeddedSkinning skinning;
  };

  Result<void> room_for(const std::string& name, const std::string& field) const;
  Result<ExampleReport> complete(const std::string& name, const std::vector<HandleTarget>& targets);

  sim::example_based::ExampleSet& set_;
  std::optional<PoseSolver> solver_;
  std::optional<Drawn> drawn_;
};

// Rest positions [m].
std::vector<Vec3> points_of(const std::vector<sim::example_based::Handle>& handles);

}  // namespace crumple::authoring
