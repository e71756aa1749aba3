#pragma once

#include "server/sim/fem/fem_state.h"
#include "server/sim/fem/macro_states.h"
#include "server/sim/fem/rest_body.h"
#include "server/sim/parallel_for.h"

#include <Eigen/SparseCore>

#include <vector>

// What the elements of a body do at given node positions. Every function is a pass over the tets, each written by one
// thread; nothing is summed here across tets but where a sum is returned, in mesh order, and energies, chunk by chunk.
namespace crumple::sim::fem {

// Results of an element pass, one a tet; of a body of groups of tets only `macros`. Assembly, fracture and display
// read them. Plastic strains are as FemState has them: one an element, or none, all zero.
struct Elements {
  std::vector<Mat3> Q;       // rotation, det +1
  std::vector<Mat3> sigma;   // elastic stress in the tet's unrotated axes [Pa]
  std::vector<Mat34> force;  // elastic force on each of the tet's nodes, in W [N]
  std::vector<Mat34> core;   // Q c_i: RestBody::core in world axes
  std::vector<double> chunk_energy;  // elastic energy of kTetsPerChunk tets each, as of the last pass [J]
  std::vector<int> chunk_inverted;   // how many of those have a negative volume, likewise
  MacroStates macros;

  static constexpr int kTetsPerChunk = 256;
  void resize(int tet_count);
  bool is_of(const RestBody& rest) const;  // not before the first update, nor after elements were parted
  // Corners of all elements in a row: 4 tet + local node, or those of groups and patches.
  const double* forces() const;
  const double* cores() const;
};

// Fills `elements` (resized if needed) for positions x. x: node positions [m].
void update_elements(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                     const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, Elements& elements);

// Q sigma Q^T: Cauchy-like stress of tet t in world axes [Pa]; of groups as tet_stress has it.
Mat3 element_stress(const RestBody& rest, const Elements& elements, int t);
// Q n_i of tet t, times fill [m^2].
Mat34 element_normals(const RestBody& rest, const Elements& elements, int t);

// eps^P of tet t; of groups the mean of its two. plastic_strain: one an element.
Mat3 element_plastic_strain(const RestBody& rest, const std::vector<Mat3>& plastic_strain, int t);

// What the law makes of tet t by itself, whatever the body's elements are.
struct TetLaw {
  Mat3 Q, sigma;  // as in Elements
  Mat3 stress;    // sigma and what balances the moment of the forces (moment_balance) [Pa]
};
TetLaw tet_law(const RestBody& rest, int t, const Mat34& x, const Mat3& plastic_strain);

// Total co-rotated strain eps~ of tet t at rotation Q, plastic part included.
Mat3 element_strain(const RestBody& rest, int t, const Mat34& x, const Mat3& Q);

// Plastic flow of one step (eq. 3) at the positions x of the end of the step. Does nothing if no material of the body
// yields. `elements` is left as update_elements would at x with the new plastic strain.
void plastic_flow(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x, double dt,
                  double creep_dt, const ThreadPool& pool, std::vector<Mat3>& plastic_strain, Elements& elements);

// f: 3n, the sum of the elements' forces on each node [N].
void gather_forces(const RestBody& rest, const std::vector<Tet>& tets, const Elements& elements,
                   Eigen::Ref<Eigen::VectorXd> f);

// f: 3n, elastic force on each node, plastic strain included [N]; f = -dE/dx where corotational.h says so.
// Calls update_elements.
void elastic_forces(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                    const std::vector<Mat3>& plastic_strain, const ThreadPool& pool, Elements& elements,
                    Eigen::Ref<Eigen::VectorXd> f);

// Sum of fill V (lambda/2 tr(eps^E)^2 + mu eps^E : eps^E), of groups with their hourglass forces and patches [J].
double elastic_energy(const RestBody& rest, const std::vector<Tet>& tets, const std::vector<Vec3>& x,
                      const std::vector<Mat3>& plastic_strain);

// The same at the positions of the last pass over `elements`, which has computed it.
double elastic_energy(const RestBody& rest, const Elements& elements);

// Tets of negative volume at the positions of the last pass over `elements`, which has counted them; not of a body of groups.
int inverted_count(const Elements& elements);

// Tets of negative volume at x.
int inverted_count(const std::vector<Tet>& tets, const std::vector<Vec3>& x, const ThreadPool& pool);

// -df/dx of a whole body, 3n x 3n, both triangles. fixed_rotation: eq. 2, positive semi-definite; exact: with dQ/dF,
// may be indefinite. For statics and modes; a step assembles with assembly.h.
enum class Tangent { fixed_rotation, exact };
Eigen::SparseMatrix<double> tangent_stiffness(const RestBody& rest, const std::vector<Tet>& tets,
                                              const std::vector<Vec3>& x, const std::vector<Mat3>& plastic_strain,
                                              Tangent tangent);

}  // namespace crumple::sim::fem
