#pragma once

#include "server/sim/contact/detect.h"
#include "server/sim/contact/found_rows.h"
#include "server/sim/contact/sweep_and_prune.h"
#include "server/sim/contact/tet_overlap.h"

#include <limits>
#include <span>
#include <vector>

// Private to detect*.cpp: one call of detect(), from boxes to rows.
namespace crumple::sim::contact {

inline constexpr int kBundle = 32;  // boundary tets that are left out together where a zone is far from all of them
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A body moved to where contact is looked for.
struct PlacedBody {
  std::vector<Vec3> x;  // [m]
  std::vector<Vec3> v;  // with which it got there [m/s]
};

// A component of a body: what the broad phase handles.
struct Unit {
  int body = -1;
  const CollisionComponent* component = nullptr;
  Box3 box;
  double mass = 0;               // infinite if immovable
  std::vector<Box3> tet_boxes;   // of its boundary tets, if it is near another unit or meets itself
  std::vector<Box3> bundles;     // of kBundle of those each
  Vec3 move = Vec3::Zero();      // mean displacement in the step [m]
  double diagonal = 0;           // of its box at the end of the step [m]
  bool fast = false;             // boxes then hold the whole way from the start of the step
  Box3 moves;                    // displacements of its nodes in the step [m]
  Box3 way_box;                  // its way from the start of the step to the end
  std::vector<Box3> way_boxes;   // of its boundary tets, if it might pass through another unit

  void clear();  // as new, but for the memory of its boxes
};

struct TetOfUnit {
  const Unit& unit;
  const CollisionTet& tet;
  const OrientedTet& shape;
};

// What of two units carries their rows: reduced mass and smaller volume.
struct Share {
  double mass, volume;  // [kg], [m^3]
};

struct Detector {
  const DetectionInput& in;
  std::vector<PlacedBody>& placed;  // the first of them are of in.bodies
  std::vector<Unit>& units;         // the first unit_count of them
  int unit_count = 0;

  const CollisionTet& tet(const Unit& unit, int k) const { return in.bodies[unit.body].mesh->tets[k]; }
  // Whether the solve alone moves the unit's body.
  bool in_solve(const Unit& unit) const { return !in.bodies[unit.body].rigid || is_fragment(unit.body); }
  bool is_fragment(int body) const {
    return body < static_cast<int>(in.bodies.size()) && in.bodies[body].rigid && in.bodies[body].rigid->in_solve;
  }
  bool are_pieces_of_one(const Unit& a, const Unit& b) const {
    return a.body == b.body || (in.bodies[a.body].origin >= 0 && in.bodies[a.body].origin == in.bodies[b.body].origin);
  }
  Mat34 nodes(const Unit& unit, const CollisionTet& t) const {
    const std::vector<Vec3>& x = placed[unit.body].x;
    Mat34 X;
    X << x[t.nodes[0]], x[t.nodes[1]], x[t.nodes[2]], x[t.nodes[3]];
    return X;
  }
  // Part s of the step's way from the start.
  Mat34 nodes_at(const Unit& unit, const CollisionTet& t, double s) const {
    if (s == 1) return nodes(unit, t);
    return (1 - s) * at_start(unit, t) + s * nodes(unit, t);
  }

  void place(int body);
  void add_units(int body);
  Unit& add_unit();
  bool may_meet(const Unit& a, const Unit& b) const;
  void fill_tet_boxes(Unit& unit) const;
  int samples(const Unit& a, const Unit& b) const;
  void meet(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const;
  // Whether they move further against each other than the thinner one is thick.
  bool may_pass(const Unit& a, const Unit& b) const;
  void fill_way_boxes(Unit& unit) const;
  // Whether velocities within one of them differ by more than that in a step.
  bool changes(const Unit& a, const Unit& b) const;
  // Adds rows of features that would pass wholly through the other unit; true if any would. And rows that hold off what is near.
  bool meet_swept(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const;
  void add_swept_side(ContactRow& row, int side, double t, const Unit& unit, int tet_at, std::span<const int> nodes,
                      std::span<const double> weights) const;
  void meet_pair(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const;
  Share share_of(const Unit& a, const Unit& b) const;
  void meet_at(double s, const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const;
  void meet_tets(double s, const TetOfUnit& a, const TetOfUnit& b, const Share& share, FoundRows& found) const;
  const SelfContact* self(const Unit& unit) const;
  void meet_itself(const Unit& unit, const ThreadPool& pool, std::vector<ContactRow>& rows) const;
  void meet_patches(const Unit& unit, const SurfacePatch& a, const SurfacePatch& b, FoundRows& found) const;
  void meet_plane(const Unit& unit, int plane, std::vector<ContactRow>& rows) const;
  void meet_plane_raw(const Unit& unit, int plane, std::vector<ContactRow>& rows) const;
  ContactRow plane_row(const Unit& unit, int plane, const Vec3& point, double area, double volume) const;
  void set_friction(ContactRow& row, double a, double b) const;
  Vec3 add_side(ContactRow& row, int side, double s, const Unit& unit, const CollisionTet& t, const Eigen::Vector4d& b) const;
  void set_rigid(ContactRow& row, int side, double s, const RigidMotion& rigid) const;
  void finish(ContactRow& row, const Vec3& u, double s, double depth, double mass, double volume) const;
  // The rows of one pair of components share its reduced mass by area, and all are as strong as a patch of some size. The first
  // one is marked for the numbering of pairs.
  void share_out(const Share& share, std::span<ContactRow> rows) const;
  Mat34 at_start(const Unit& unit, const CollisionTet& t) const;
  void turn_back(ContactRow& row, const Vec3& u, const Mat34& a, const Mat34& b) const;
};

}  // namespace crumple::sim::contact
