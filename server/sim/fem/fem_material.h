#pragma once

#include <limits>

namespace crumple::sim::fem {

// How Q is factored out of F (Parker & O'Brien 2009, section 3; DESIGN decision 2).
enum class RotationRule {
  svd,       // sign-corrected SVD, the default: survives inversion at any dt
  polar_qr,  // the paper's: polar, and QR below 6 % of the reference volume
};

// A material of a finite-element body; artists set all of it.
struct FemMaterial {
  double young = 1e6;            // E [Pa]
  double poisson = 0.3;          // nu [-], 0 <= nu < 0.5
  double density = 1000;         // rho [kg/m^3]
  double damping_mass = 0;       // Rayleigh: C = damping_mass M + damping_stiffness K [1/s]
  double damping_stiffness = 0;  // [s]
  RotationRule rotation = RotationRule::svd;

  // Plasticity, eq. 3. yield = infinity: elastic.
  double yield = std::numeric_limits<double>::infinity();  // y, Frobenius norm of the elastic strain [-]
  double creep = 0;              // c in [0, 1], fraction of the overstrain that flows in `creep_dt`
  double max_plastic = 0.3;      // n, bound on |eps^P| [-]
  bool raw_creep = false;        // the paper's: c per update, whatever dt is

  // Fracture, section 5.
  bool breakable = false;
  double toughness = std::numeric_limits<double>::infinity();  // [Pa]; [N] if raw_toughness
  bool raw_toughness = false;    // the paper's: eigenvalue in newtons, depends on the mesh
  int fracture_interval = 1;     // look for splits every so many steps
  int max_splits_per_step = 200;

  double friction = 0.4;         // mu of contacts [-]

  double cg_tolerance = 1e-3;    // relative residual of the solve
  int cg_max_iterations = 400;
};

}  // namespace crumple::sim::fem
