#pragma once

#include "server/authoring/shapes/box_lattice.h"
#include "server/sim/scene.h"

#include <cstdint>

// Scenes stated exactly enough that other engines can build and have built them; docs/lab.md repeats the statements.
namespace crumple::lab {

// A beam along x, the face x = 0 fixed, under gravity; dt = 1/60 s, rho = 1000.
struct BeamOptions {
  authoring::Lattice lattice = authoring::Lattice::femfx;
  std::array<int, 3> cells{25, 4, 4};
  Vec3 size{2, 0.4, 0.4};        // [m]
  double young = 1e7;            // [Pa]
  double poisson = 0.3;
  double damping_mass = 0.15;    // C = damping_mass M + damping_stiffness K
  double damping_stiffness = 0.004;
};
Result<sim::SceneDescription> beam_scene(const BeamOptions& options);

// 64 soft cubes of side 1 m (2 x 2 x 2 cells each) dropped between planes.
sim::SceneDescription pile_scene();

// A 2 x 2 x 0.05 m panel of 2,400 tets, its four edges fixed, hit by a box of 20 kg at 40 m/s.
sim::SceneDescription panel_scene();

// 50 barrels of 20 kg through 45 pegs between walls: rigid hulls of the barrel of 288 triangles. seed: of their depth and
// orientation.
sim::SceneDescription barrels_scene(std::uint64_t seed = 1);

}  // namespace crumple::lab
