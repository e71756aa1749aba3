#pragma once

#include "server/lab/chart/study.h"

// The measures that studies are made of. Each runs a set-up of its scene and compares it with its reference. Where the
// reference is uncertain, its own error is reported as `floor`.
namespace crumple::lab::chart {

// ---- beams (beam_measures.cpp) -----------------------------------------------------------------------------------
// Beam B: 1 x 0.16 x 0.16 m, E = 1e6 Pa, held at x = 0, dropped under gravity for one second. Cells across the
// thickness; six times as many along it. Error of the whole motion, mass-weighted, against direct solves of the same steps.
Measure beam_against_direct_solves();
// The same beam in total error of its tip, against the limit of mesh and dt to zero (truth_of_beam_b). Also reports the
// parts: error_solver, error_time, error_mesh.
Measure beam_total_error();
// Beam B with much mass damping, until it rests: tip against the converged -0.4793 m.
Measure beam_at_rest();
// Beam A: 2 x 0.4 x 0.4 m, E = 1e7 Pa, damped, ten seconds; tip against the equilibrium of the same mesh.
Measure beam_a();
// S12's swing: the beam of 240 tets under gravity; tip against the stored run of an independent code, or, if that is
// not at hand, against this code's own limit of dt to zero.
Measure swing();
// Wall time only.
Measure beam_cost();

// ---- statics (static_measures.cpp) -------------------------------------------------------------------------------
// S03's cantilever on lattices of our own; tip against quadratic tets of the case, or against Timoshenko's beam.
Measure cantilever_on_lattices();
// A stored case at a stored level, against the field or number that its set-up names.
Measure stored_case();
// S03's cantilever solved in the set-up's precision against double on the same mesh.
Measure static_precision();
// Largest relative gap of the first Piola stress between the corotational law and St. Venant-Kirchhoff at a strain:
// simple shear, or stretch with the sides held. Closed forms; nothing is solved.
Measure law_gap_in_shear();
Measure law_gap_in_stretch();
// A stored case: the corotational solution against CalculiX's St. Venant-Kirchhoff one.
Measure law_gap_of_case();

// ---- dents (dent_measures.cpp) -----------------------------------------------------------------------------------
// A block of soft metal struck on one side. Shape that stays, without its rigid motion, against our finest finite
// elements; also error_motion, of the centre of mass.
Measure dent();

// ---- contact (contact_measures.cpp) ------------------------------------------------------------------------------
Measure sinking_block();                  // raw damping contact: v = m g / (phi A)
Measure resting_block();                  // the default law: depth of a block at rest, by its edge
Measure sliding_block(double friction);   // 30 degrees: a = g (sin - mu cos)
Measure sticking_block();                 // 26.0 degrees, mu = 0.5: drift in two seconds, by its edge

// ---- wire (wire_measures.cpp) ------------------------------------------------------------------------------------
// A frame of beam B in motion through a codec and back, against the exact positions, by the body's size; wall seconds of
// coding and decoding 60 frames. Also bytes a vertex.
Measure wire();

// ---- ensembles (ensemble_measures.cpp) ---------------------------------------------------------------------------
Measure pile_ensemble();
Measure panel_ensemble();

}  // namespace crumple::lab::chart
