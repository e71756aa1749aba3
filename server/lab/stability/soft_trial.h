#pragma once

#include "server/lab/stability/method.h"
#include "server/sim/fem/bdf2.h"
#include "server/sim/fem/implicit_euler.h"
#include "server/sim/linear_solver/multigrid_hierarchy.h"

#include <functional>
#include <random>

namespace crumple::lab::stability {

// One finite-element body without contact, stepped by a method of the table, and what is measured of it.
class SoftTrial {
 public:
  SoftTrial(const sim::TetMesh& mesh, sim::fem::FemMaterial material, const FemMethod& method);

  sim::TetMesh mesh;
  FemMethod method;
  sim::fem::RestBody rest;
  sim::fem::FemState state;
  Eigen::VectorXd force;  // 3n, external [N]
  std::vector<sim::fem::PrescribedNode> prescribed;
  sim::fem::StepScratch scratch;
  sim::fem::Bdf2Scratch bdf2_scratch;
  sim::linear_solver::MultigridHierarchy hierarchy;  // of multigrid steps
  sim::ThreadPool pool{1};

  void deform(const std::function<Vec3(const Vec3&)>& map);  // x := map(X), v := 0
  // Steps until the time is over or the body is not sound any more. `after_step` may end it by returning false.
  void run(double seconds, double dt, const std::function<bool()>& after_step = {});

  double kinetic() const;  // [J]
  double elastic() const;  // [J], with the method's own rotation; of groups of tets the core's
  double energy() const { return kinetic() + elastic(); }
  Vec3 momentum() const;          // [kg m/s]
  Vec3 angular_momentum() const;  // about the centre of mass [kg m^2/s]
  Vec3 centre() const;            // [m]
  double rigid_kinetic() const;   // of the motion as a rigid body with the present shape, P and L [J]
  double spin() const;            // |L| over the rest shape's mean moment of inertia [rad/s]
  int inverted() const;           // tets of negative volume
  double shape_error() const;     // largest distance of a node from the best rigid placement of the rest shape [m]
  // Everything finite and within a kilometre.
  bool sound() const;

  double largest_kinetic = 0, largest_energy = 0;  // of the last run, with its start [J]
  double worst_residual = 0;                       // of the last run's solves
  int capped = 0;                                  // solves of the last run that did not converge
};

// A cube of n^3 cells of six tets, side 1 m, from the origin.
sim::TetMesh unit_cube(int n);
// Cells of size / cells from the origin, six tets each.
sim::TetMesh block(const Vec3& size, const std::array<int, 3>& cells);

// A unit cube of n^3 cells, n >= 2, in which an interior node stands so near to the opposite face of one tet that the
// tet has `quality` of its height; 0 flat, negative inverted. The coplanar neighbour is squashed with it.
sim::TetMesh cube_with_sliver(int n, double quality);

// E = 1e5 Pa, nu = 0.3, rho = 1000: the literature's soft cube.
sim::fem::FemMaterial soft_material();

// Uniform numbers that are the same with every library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  Vec3 vec3(double low, double high);

 private:
  std::mt19937_64 engine_;
};

// Every node at a random place in the box [low, high]^3 [m], at rest.
void scramble(SoftTrial& trial, std::uint64_t seed, double low = 0, double high = 1);

}  // namespace crumple::lab::stability
