#pragma once

#include "server/authoring/artist_mesh.h"

#include <functional>

// Examples from simulation: the asset's surface, filled with a metal that yields, pressed by finite elements.
namespace crumple::rig {

struct CrushOptions {
  int axis = 0;                // the side pressed in: x, y, z ...
  bool from_max = true;        // ... from its largest coordinate inwards, or its smallest
  double depth = 0.3;          // of the extent along the push, (0, 0.6]
  double yield_strain = 0.01;  // norm of the elastic strain's deviator at which it flows, [1e-4, 1]
  int threads = 1;
};

struct CrushReport {
  double thickness = 0;       // what is left of the extent along the push, as a part of it [-]
  double plastic_strain = 0;  // largest [-]
  int inverted_tets = 0;      // at the end
  int steps = 0;
};

struct Crushed {
  authoring::DeformedShape copy;  // of the set's render surface, moved back over the rest shape (least squares)
  CrushReport report;
};

// About as many tets as the asset has, drawn onto its render surface (boundary_fit.h). The body lies on a plane and a
// plate comes down on it, goes back up, and lets it spring back. Deviatoric plasticity, no gravity; stiffness in
// proportion to the size, so that the press is slow against sound. Deterministic. Errors: depth or yield_strain out of
// range, no render surface, what enclosing_mesh or sim::validate rejects.
Result<Crushed> crush(const sim::example_based::ExampleSet& set, const std::string& name, const CrushOptions& options,
                      const std::function<void(double done)>& progress = {});

// What both ways of pressing begin with: tets of the press's own, drawn onto the render surface, about as many as the
// asset has; those of the asset may be flat, where they had to be pushed around vertices. Errors: depth or yield_strain out
// of range, no render surface, enclosing_mesh's.
Result<sim::TetMesh> tets_to_press(const sim::example_based::ExampleSet& set, const CrushOptions& options);

}  // namespace crumple::rig
