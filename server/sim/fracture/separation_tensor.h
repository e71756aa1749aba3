#pragma once

#include "common/types.h"
#include "server/sim/fracture/toughness.h"
#include "server/sim/mesh/node_stars.h"
#include "server/sim/parallel_for.h"

#include <cmath>
#include <span>
#include <vector>

// The separation tensor of O'Brien & Hodgins 1999, used by Parker & O'Brien 2009, section 5.
namespace crumple::sim::fracture {

// m(a) = a a^T / |a|, zero for a = 0: eigenvector a with eigenvalue |a|.
Mat3 outer_by_length(const Vec3& a);

// Nodal forces of the tensile and the compressive part of each tet's stress; sized on first use.
struct PartForces {
  std::vector<Mat34> tensile;      // f+ on the tet's nodes [N]
  std::vector<Mat34> compressive;  // f-
};

// Of tet t, by f = Q sigma n_i / 3: stress = Q sigma Q^T in W [Pa], normals as below.
void set_part_forces(int t, const Mat3& stress, const Mat34& normals, PartForces& forces);

// S = 1/2 (-m(F+) + sum m(f+) + m(F-) - sum m(f-)) of every node, F+ and F- the sums of f+ and f- over its tets [N].
// stress: Q sigma Q^T, one a tet, in W [Pa]. normals: Q n_i in the columns, one a tet: outward area-weighted normal
// opposite node i, in W, times the tet's fill [m^2]. S: one a node.
// As published, m(F-) enters whole: a surface node that a load presses on in a two- or three-dimensional state of
// compression gets a positive eigenvalue of about a sixth of the pressure times H^2.
// Same bits for any number of threads: tets write their own forces, each node sums its tets by ascending id.
void separation_tensors(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat3> stress,
                        std::span<const Mat34> normals, const ThreadPool& pool, PartForces& forces,
                        std::span<Mat3> S);

// S of one node.
Mat3 separation_tensor(int node, const std::vector<Tet>& tets, const NodeStars& stars, const PartForces& forces);

// A(e) = 1/6 sum |n_i . e| over the node's tets [m^2]: uniform uniaxial stress s along e gives S the eigenvalue s A(e)
// where no face is loaded. Dividing by it makes strength a stress that does not depend on the mesh (the paper's is a
// force, which does).
double cut_area(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat34> normals, int node,
                const Vec3& e);

// A node that is to be split, and how.
struct SplitCandidate {
  int node = 0;
  Vec3 normal = Vec3::UnitX();  // of the split plane, in W
  double strength = 0;          // eigenvalue / A(e) [Pa], or the eigenvalue [N]
  double toughness = std::numeric_limits<double>::infinity();  // that it exceeds: tougher tets stay together
  double area = 1;              // A(e) [m^2]; 1 if strength is the eigenvalue

  bool breaks() const { return strength > toughness && std::isfinite(strength); }
};

// The nodes whose strength exceeds the toughness [Pa; N if raw_toughness], ascending. Of a node's positive eigenvalues
// the strongest counts. Tensors that are not finite give none.
std::vector<SplitCandidate> split_candidates(const std::vector<Tet>& tets, const NodeStars& stars,
                                             std::span<const Mat34> normals, std::span<const Mat3> S,
                                             double toughness, bool raw_toughness, const ThreadPool& pool);

// The same for a body of several materials. A node between tets of different toughness is looked at once for each of
// them, the least first, and the first that is exceeded counts. In each look the tougher tets of the node are one piece:
// their forces and their normals are summed before they enter S and A(e). So the pull along a steel frame, which its
// own tets carry, does not break the glass that it holds; what steel and glass do to each other does, and at the stress
// at which glass alone would break. Tets that never give way are the toughest.
// forces: of separation_tensors.
std::vector<SplitCandidate> split_candidates(const std::vector<Tet>& tets, const NodeStars& stars,
                                             std::span<const Mat34> normals, const PartForces& forces,
                                             std::span<const Mat3> S, const Toughness& toughness,
                                             const ThreadPool& pool);
void split_candidates(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat34> normals,
                      const PartForces& forces, std::span<const Mat3> S, const Toughness& toughness, const ThreadPool& pool,
                      std::vector<SplitCandidate>& candidates);  // replaces `candidates`

// The same at one node; breaks() is false where it holds. residual: what is added to its S [N].
SplitCandidate split_candidate(int node, const std::vector<Tet>& tets, const NodeStars& stars,
                               std::span<const Mat34> normals, const PartForces& forces, const Toughness& toughness,
                               const Mat3& residual);

}  // namespace crumple::sim::fracture
