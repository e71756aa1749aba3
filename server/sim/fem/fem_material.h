#pragma once

#include <limits>

namespace crumple::sim::fem {

// How Q is factored out of F (Parker & O'Brien 2009, section 3; DESIGN decision 2).
enum class RotationRule {
  svd,       // sign-corrected SVD, the default: survives inversion at any dt
  polar_qr,  // the paper's: polar, and QR below 6 % of the reference volume
};

// What yields and what flows (eq. 3).
enum class FlowRule {
  additive,    // the paper's: the whole elastic strain, its change of volume included
  deviatoric,  // its deviator alone: von Mises' (J2) yield, and plastic strain without trace; besides, forces have no
               // moment (moment_balance), which the paper's get from plastic strain that is not coaxial
};

// In which order nodes are looked at for splits (section 5).
enum class FractureOrder {
  random,         // the paper's: from the world's seed, each node by what it was before any of them split
  largest_first,  // O'Brien & Hodgins (1999): the largest eigenvalue first, and what a split changed anew
};

// A material of a finite-element body; artists set all of it. Of a body of several materials, material_region.h says
// which fields go for the whole body.
struct FemMaterial {
  double young = 1e6;            // E [Pa], (0, 1e13]
  double poisson = 0.3;          // nu [-], 0 <= nu < 0.5
  double density = 1000;         // rho [kg/m^3], (0, 1e6]
  double damping_mass = 0;       // Rayleigh: C = damping_mass M + damping_stiffness K [1/s], [0, 1e4]
  double damping_stiffness = 0;  // [s], [0, 10]
  RotationRule rotation = RotationRule::svd;

  // Plasticity, eq. 3. yield = infinity: elastic.
  FlowRule flow = FlowRule::additive;
  double yield = std::numeric_limits<double>::infinity();  // y, Frobenius norm of what `flow` measures [-], >= 0
  double creep = 0;              // c in [0, 1], fraction of the overstrain that flows in `creep_dt`
  double max_plastic = 0.3;      // n, bound on |eps^P| [-], [0, 10]
  bool raw_creep = false;        // the paper's: c per update, whatever dt is

  // Fracture, section 5.
  bool breakable = false;
  double toughness = std::numeric_limits<double>::infinity();  // [Pa]; [N] if raw_toughness; > 0
  bool raw_toughness = false;    // the paper's: eigenvalue in newtons, depends on the mesh
  int fracture_interval = 1;     // look for splits every so many steps, [1, 1e6]
  int max_splits_per_step = 200; // of each piece of a broken body, [1, 1e6]
  FractureOrder fracture_order = FractureOrder::random;

  double dust = 0;               // grains drawn to a square metre of new surface [1/m^2], [0, 1e6]

  double friction = 0.4;         // mu of contacts [-], [0, 10]

  double cg_tolerance = 1e-3;    // relative residual of the solve, [1e-14, 0.5]
  int cg_max_iterations = 400;   // [1, 100,000]
};

}  // namespace crumple::sim::fem
