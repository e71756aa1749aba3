#pragma once

#include "common/frame_codec.h"
#include "server/authoring/shapes/box_lattice.h"
#include "server/lab/static_solve.h"
#include "server/sim/fem/fem_material.h"
#include "server/sim/linear_solver/solver_kind.h"
#include "server/sim/scene.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace crumple::lab::chart {

enum class BodyKind { rigid, default_rig, fitted_rig, finite_elements };

// Everything that a knob can turn. A measure reads what its scene has and leaves the rest. A new option of the product
// is one more field here and one more knob in knobs.cpp.
struct Setup {
  double dt = 1.0 / 60;            // [s]
  double cg_tolerance = 1e-3;      // the product's default
  int cg_cap = 3000;               // no cap in reach
  bool guarded = true;             // the server's guard answers capped solves and growing energy
  std::optional<bool> float_solver;  // matrix blocks in float; not said: as the product chooses
  sim::linear_solver::SolverKind solver = sim::linear_solver::SolverKind::automatic;
  Precision precision = Precision::double_;  // of a static solve's factor
  sim::fem::RotationRule rotation = sim::fem::RotationRule::svd;
  sim::Integrator integrator = sim::Integrator::backward_euler;
  int threads = 1;
  authoring::Lattice lattice = authoring::Lattice::kuhn;
  sim::fem::ElementKind element = sim::fem::ElementKind::linear_tetrahedra;
  int cells = 4;                   // across the thickness of a beam, along an edge of a block
  BodyKind body = BodyKind::finite_elements;
  double alpha = 100;              // of an example-based body [1/m]
  double phi = 1e6;                // of the paper's damping contact [N s/m^3]
  double kappa = 100;              // of the default contact
  double recovery_steps = 4;
  Codec codec = Codec::quantised16;
  bool compress = true;
  double strain = 0;               // of a material point [-]
  std::string case_name, level, field;  // of the yardstick
  double poisson = 0;              // of a case that lists several [-]
  double enclosing = 0;            // cell of a lattice that carries the case instead of its mesh [m]; 0: its mesh
  int seed = 1;                    // of a chaotic scene
};

struct KnobValue {
  double value;
  std::string label;
  bool heavy = false;  // left out by --quick
};

// A name, values, and how a value changes a set-up.
struct Knob {
  std::string name;
  std::vector<KnobValue> values;
  std::function<void(Setup&, double)> turn;
};

namespace knobs {
Knob dt();                             // 1/15 .. 1/960 s
Knob cg_tolerance();                   // 1e-1 .. 1e-8
Knob cg_cap(bool guarded = false);     // 5 .. 500, at a tolerance out of reach; the guard would go on after the cap
Knob cells(std::vector<int> across, int heavy_from = 1000);
Knob threads();                        // 1, 2, 4 .. as many as the process may use
Knob alpha(std::vector<double> values);
Knob phi();
Knob kappa();
Knob strain();
Knob levels(std::vector<std::string> names, const std::string& heavy = "");
Knob enclosing(std::vector<double> cell_sizes, double heavy_below);
Knob grid(std::vector<double> dts, std::vector<double> tolerances, double heavy_below);  // dt x CG tolerance
}  // namespace knobs

}  // namespace crumple::lab::chart
