#pragma once

#include "server/sim/mesh/surface_mesh.h"

#include <functional>
#include <vector>

namespace crumple::rig {

// What a shell is made of. Its thickness cancels: all forces and masses are in proportion to it.
struct ShellMaterial {
  double wave_speed = 100;        // sqrt(E / rho), of the sheet in its plane [m/s]
  double bending = 0.1;           // stiffness of the springs across edges, in parts of those along them [-]
  double yield_strain = 0.01;     // of a length along an edge, at which it flows [-]
  double fold_yield = 0.2;        // of a length across an edge, in parts of yield_strain: a sheet bends sooner than it
                                  // stretches [-]
  double largest_stretch = 0.05;  // of a rest length along an edge, by flow [-]; folds have no bound
};

// A surface as masses and springs, the thin shell by which Jones et al. 2016 make an example (section 5, figure 5). One
// spring an edge keeps lengths: k = E t (A_1 + A_2) / l^2 of the triangles beside it; one from corner to corner across
// each edge resists folding. A spring strained beyond its yield flows: its rest length follows, so that it stays bent.
// Steps are position-based with compliance (MM), one pass a substep, springs in the order of edges, on one thread: the
// same bits each time. A shell does not meet itself.
class ThinShell {
 public:
  // Of an edge with more than two triangles the first two fold.
  ThinShell(const sim::SurfaceMesh& surface, const ShellMaterial& material);

  // Where a vertex may be: takes it from x [m], given where it was before the substep.
  using Obstacle = std::function<void(const Vec3& before, Vec3& x)>;

  // One substep of h [s]. gravity [m/s^2]. damping: of velocities [1/s].
  void substep(double h, const Vec3& gravity, double damping, const Obstacle& obstacle);

  // Springs beyond their yield take the rest of it as rest length; called as often as wished.
  void flow();

  const std::vector<Vec3>& x() const { return x_; }
  std::vector<Vec3>& x() { return x_; }
  void hold(int vertex) { inverse_mass_[vertex] = 0; }

  double largest_fold() const;     // of a fold's rest length against that at first [-]

 private:
  struct Spring {
    int a, b;
    double first, rest;  // lengths [m]
    double compliance;   // 1 / k
    bool fold;
  };

  ShellMaterial material_;
  std::vector<Vec3> x_, v_, before_;
  std::vector<double> inverse_mass_;  // 1/kg at rho t = 1; 0: held
  std::vector<Spring> springs_;
};

}  // namespace crumple::rig
