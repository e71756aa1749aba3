#include "server/sim/contact/detect.h"

#include "server/sim/contact/submerged_nodes.h"
#include "server/sim/contact/sweep_and_prune.h"
#include "server/sim/contact/tet_overlap.h"
#include "server/sim/contact/weight_friction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace crumple::sim::contact {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A body moved to where contact is looked for.
struct PlacedBody {
  std::vector<Vec3> x;  // [m]
  std::vector<Vec3> v;  // with which it got there [m/s]
};

// A component of a body: what the broad phase handles.
struct Unit {
  int body;
  const CollisionComponent* component;
  Box3 box;
  double mass;                   // infinite if immovable
  std::vector<Box3> tet_boxes;   // of its boundary tets, if it is near another unit or meets itself
  Vec3 move = Vec3::Zero();      // mean displacement in the step [m]
  double diagonal = 0;           // of its box at the end of the step [m]
  bool fast = false;             // boxes then hold the whole way from the start of the step
};

// The paper's rule for fast bodies (section 6): they are looked at at every sixth of their diagonal on their way.
constexpr double kFastPart = 1.0 / 6;
constexpr int kMaxSamples = 16;

// Rows of rigid fragments are weaker and take depth back more slowly than others, by these factors: a heap of shards locks into
// itself, and settles sooner so; chaotic scenes were on average solved in a fifth less.
constexpr double kFragmentKappa = 0.3, kFragmentRecovery = 2;

// What overlaps, by what is known of its direction.
struct FoundRows {
  std::vector<ContactRow> surface;
  // Pairs of tets without a face of the surface in their overlap say nothing about the direction. They count only where
  // there is nothing better, when two bodies have gone deep into each other; beside a resting contact they would push
  // sideways.
  std::vector<ContactRow> buried;
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
  std::vector<PlacedBody> placed;
  std::vector<Unit> units;

  const CollisionTet& tet(const Unit& unit, int k) const { return in.bodies[unit.body].mesh->tets[k]; }
  // Whether the solve alone moves the unit's body.
  bool in_solve(const Unit& unit) const { return !in.bodies[unit.body].rigid || is_fragment(unit.body); }
  bool is_fragment(int body) const {
    return body < static_cast<int>(in.bodies.size()) && in.bodies[body].rigid && in.bodies[body].rigid->in_solve;
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
  bool may_meet(const Unit& a, const Unit& b) const;
  void fill_tet_boxes(Unit& unit) const;
  int samples(const Unit& a, const Unit& b) const;
  void meet(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const;
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
  Mat34 at_start(const Unit& unit, const CollisionTet& t) const;
  void turn_back(ContactRow& row, const Vec3& u, const Mat34& a, const Mat34& b) const;
};

void Detector::place(int body) {
  const CollisionBody& source = in.bodies[body];
  PlacedBody& out = placed[body];
  const std::size_t n = source.x.size();
  const bool raw = in.settings.raw_damping;
  const Vec3 fall = in.dt * in.gravity;
  out.x.resize(n);
  out.v.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const RigidMotion* rigid = source.rigid ? &*source.rigid : nullptr;
    const bool falls = rigid ? rigid->movable : source.fixed.empty() || !source.fixed[i];
    out.v[i] = rigid ? Vec3(rigid->v + rigid->w.cross(source.x[i] - rigid->p_WC)) : source.v[i];
    if (falls && !raw) out.v[i] += fall;
    out.x[i] = source.x[i];
    if (!raw) out.x[i] += in.dt * out.v[i];
  }
}

void Detector::add_units(int body) {
  const CollisionBody& source = in.bodies[body];
  for (const CollisionComponent& component : source.mesh->components) {
    Unit unit{body, &component, Box3(), component.mass, {}};
    bool free = source.rigid && source.rigid->movable;
    for (int k = component.begin; k < component.end; ++k)
      for (const int node : source.mesh->tets[k].nodes) {
        unit.box.extend(placed[body].x[node]);
        unit.move += placed[body].x[node] - source.x[node];
        if (!source.rigid) free = free || source.fixed.empty() || !source.fixed[node];
      }
    if (source.rigid) unit.mass = source.rigid->mass;
    if (!free) unit.mass = kInfinity;
    unit.move /= std::max(1, 4 * (component.end - component.begin));
    unit.diagonal = unit.box.isEmpty() ? 0 : unit.box.diagonal().norm();
    unit.fast = !in.settings.raw_damping && unit.move.norm() > kFastPart * unit.diagonal;
    if (unit.fast) {
      for (int k = component.begin; k < component.end; ++k)
        for (const int node : source.mesh->tets[k].nodes) unit.box.extend(source.x[node]);
    }
    units.push_back(std::move(unit));
  }
}

bool Detector::may_meet(const Unit& a, const Unit& b) const {
  if (a.body == b.body && in.bodies[a.body].rigid) return false;
  return (in_solve(a) || in_solve(b)) && (a.mass < kInfinity || b.mass < kInfinity);
}

void Detector::fill_tet_boxes(Unit& unit) const {
  unit.tet_boxes.clear();
  for (int k = unit.component->begin; k < unit.component->boundary_end; ++k) {
    const Mat34 x = nodes(unit, tet(unit, k));
    unit.tet_boxes.emplace_back(x.rowwise().minCoeff(), x.rowwise().maxCoeff());
    if (!unit.fast) continue;
    const Mat34 start = at_start(unit, tet(unit, k));
    unit.tet_boxes.back().extend(Vec3(start.rowwise().minCoeff())).extend(Vec3(start.rowwise().maxCoeff()));
  }
}

bool share_a_node(const Tet& a, const Tet& b) {
  return std::ranges::any_of(a, [&](int node) { return std::ranges::find(b, node) != b.end(); });
}

// Boundary tets of a unit that reach into a box.
struct Near {
  std::vector<int> tets;  // in CollisionMesh::tets
  std::vector<Box3> boxes;
  std::vector<OrientedTet> shapes;

  Near(const Detector& d, const Unit& unit, const Box3& zone, double s) {
    const int begin = unit.component->begin;
    for (int k = 0; k < static_cast<int>(unit.tet_boxes.size()); ++k) {
      if (!unit.tet_boxes[k].intersects(zone)) continue;
      const Mat34 x = d.nodes_at(unit, d.tet(unit, begin + k), s);
      tets.push_back(begin + k);
      boxes.emplace_back(x.rowwise().minCoeff(), x.rowwise().maxCoeff());
      shapes.push_back(orient(x));
    }
  }
};

// The rows of one pair of components share its reduced mass by area. The first one is marked for number_pairs.
void share_mass(double mass, std::span<ContactRow> rows) {
  double area = 0;
  for (const ContactRow& row : rows) area += row.area;
  for (ContactRow& row : rows) row.mass = mass * row.area / area;
  if (!rows.empty()) rows.front().pair = 1;
}

void number_pairs(std::span<ContactRow> rows) {
  int pair = -1;
  for (ContactRow& row : rows) row.pair = pair += row.pair;
}

double reduced_mass(double a, double b) { return a == kInfinity ? b : b == kInfinity ? a : a * b / (a + b); }

// Of a piece that meets itself: two halves of it are the largest parts that can.
Share halves(const Unit& unit) { return {unit.mass / 4, unit.component->volume / 2}; }

int Detector::samples(const Unit& a, const Unit& b) const {
  if (!a.fast && !b.fast) return 1;
  const double way = (a.move - b.move).norm(), size = std::min(a.diagonal, b.diagonal);
  return std::clamp(static_cast<int>(std::ceil(way / std::max(kFastPart * size, 1e-12))), 1, kMaxSamples);
}

void Detector::meet(const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const {
  const int count = samples(a, b);
  for (int k = 1; k <= count && rows.empty(); ++k) meet_at(static_cast<double>(k) / count, a, b, rows);
}

// Contact at part s of the step's way.
void Detector::meet_at(double s, const Unit& a, const Unit& b, std::vector<ContactRow>& rows) const {
  const Box3 zone = a.box.intersection(b.box);
  const Near near_a(*this, a, zone, s), near_b(*this, b, zone, s);
  std::vector<IndexPair> pairs;
  sweep_and_prune(near_a.boxes, near_b.boxes, pairs);

  const double volume_a = a.mass < kInfinity ? a.component->volume : kInfinity;
  const double volume_b = b.mass < kInfinity ? b.component->volume : kInfinity;
  const Share share{reduced_mass(a.mass, b.mass), std::min(volume_a, volume_b)};
  FoundRows found;
  for (const auto& [i, j] : pairs) {
    const CollisionTet &tet_a = tet(a, near_a.tets[i]), &tet_b = tet(b, near_b.tets[j]);
    if (a.body == b.body && share_a_node(tet_a.nodes, tet_b.nodes)) continue;
    meet_tets(s, {a, tet_a, near_a.shapes[i]}, {b, tet_b, near_b.shapes[j]}, share, found);
  }
  rows = std::move(found.surface.empty() ? found.buried : found.surface);
  share_mass(share.mass, rows);
}

// Contact of two tets at part s of the step's way.
void Detector::meet_tets(double s, const TetOfUnit& a, const TetOfUnit& b, const Share& share, FoundRows& found) const {
  if (!(a.shape.volume > 0 && b.shape.volume > 0)) return;
  const TetOverlap common = overlap(a.shape, b.shape);
  if (common.volume == 0) return;
  const ContactNormal normal = contact_normal(common, a.shape, b.shape, a.tet.exterior, b.tet.exterior);
  ContactRow row;
  row.area = normal.r.norm();
  if (!(row.area > 0)) return;
  row.normal = normal.r / row.area;
  row.point = common.centroid;
  row.volume = common.volume;
  set_friction(row, in.bodies[a.unit.body].friction, in.bodies[b.unit.body].friction);
  const Vec3 u = add_side(row, 0, s, a.unit, a.tet, barycentric(a.shape, row.point)) +
                 add_side(row, 1, s, b.unit, b.tet, barycentric(b.shape, row.point));
  finish(row, u, s, overlap_depth(common.volume, row.area), share.mass, share.volume);
  if (!in.settings.raw_damping) turn_back(row, u, at_start(a.unit, a.tet), at_start(b.unit, b.tet));
  (normal.from_surface ? found.surface : found.buried).push_back(row);
}

const SelfContact* Detector::self(const Unit& unit) const {
  return unit.mass < kInfinity ? in.bodies[unit.body].self : nullptr;
}

// A piece against itself, at the end of the step: the way there is not looked at, since what of it is fast is not known.
// Rows of two patches are a pair: friction in one place is not bounded by what presses in another.
void Detector::meet_itself(const Unit& unit, const ThreadPool& pool, std::vector<ContactRow>& rows) const {
  const SelfContact& body = *self(unit);
  const auto component = unit.component - in.bodies[unit.body].mesh->components.data();
  const int first = body.first_patch[component];
  const std::span patches(body.patches.data() + first, body.patches.data() + body.first_patch[component + 1]);
  std::vector<Box3> boxes(patches.size());
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (int k = patches[p].begin; k < patches[p].end; ++k) boxes[p].extend(unit.tet_boxes[body.tets[k] - unit.component->begin]);
  std::vector<IndexPair> pairs = sweep_and_prune(boxes);
  for (int p = 0; p < static_cast<int>(patches.size()); ++p) pairs.emplace_back(p, p);
  std::erase_if(pairs, [&](const IndexPair& p) { return near_at_rest(patches[p.first], patches[p.second]); });

  std::vector<FoundRows> found(pairs.size());
  pool.for_chunks(static_cast<int>(pairs.size()), 8, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) meet_patches(unit, patches[pairs[k].first], patches[pairs[k].second], found[k]);
  });
  const bool any_surface = std::ranges::any_of(found, [](const FoundRows& some) { return !some.surface.empty(); });
  std::vector<std::size_t> ends;
  for (const FoundRows& some : found) {
    const std::vector<ContactRow>& taken = any_surface ? some.surface : some.buried;
    rows.insert(rows.end(), taken.begin(), taken.end());
    if (!taken.empty()) ends.push_back(rows.size());
  }
  share_mass(halves(unit).mass, rows);
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) rows[ends[k]].pair = 1;
}

void Detector::meet_patches(const Unit& unit, const SurfacePatch& a, const SurfacePatch& b, FoundRows& found) const {
  const SelfContact& body = *self(unit);
  const auto box = [&](int t) -> const Box3& { return unit.tet_boxes[t - unit.component->begin]; };
  for (int i = a.begin; i < a.end; ++i)
    for (int j = &a == &b ? i + 1 : b.begin; j < b.end; ++j) {
      const int s = std::min(body.tets[i], body.tets[j]), t = std::max(body.tets[i], body.tets[j]);
      if (!box(s).intersects(box(t)) || near_at_rest(body.balls[s], body.balls[t])) continue;
      const CollisionTet &tet_s = tet(unit, s), &tet_t = tet(unit, t);
      meet_tets(1, {unit, tet_s, orient(nodes(unit, tet_s))}, {unit, tet_t, orient(nodes(unit, tet_t))}, halves(unit), found);
    }
}

void Detector::set_friction(ContactRow& row, double a, double b) const {
  const double mu = std::sqrt(a * b);
  if (in.settings.friction == FrictionLaw::coulomb) row.friction = mu;
  else row.weight_speed = weight_speed(mu, row.normal, in.gravity, in.dt);
}

ContactRow Detector::plane_row(const Unit& unit, int plane, const Vec3& point, double area, double volume) const {
  ContactRow row;
  row.normal = in.planes[plane].normal;
  row.point = point;
  row.area = area;
  row.volume = volume;
  set_friction(row, in.bodies[unit.body].friction, in.planes[plane].friction);
  row.sides[1].body = static_cast<int>(in.bodies.size()) + plane;
  return row;
}

// A row a node, not one a tet at the centroid of what is below. Which of a flat face's nodes a centroid is near changes
// with their predicted depths, as an explicit law would: under a stack the nodes of a face then take turns, up in one step
// and down in the next, for ever (a pile of 64 cubes of E = 1e6 kept 265 mm/s so). And the depth of a node is known,
// where V/A of a tet that tapers upwards is beyond it.
void Detector::meet_plane(const Unit& unit, int plane, std::vector<ContactRow>& rows) const {
  const CollisionBody& body = in.bodies[unit.body];
  const CollisionPlane& half_space = in.planes[plane];
  const PlacedBody& at = placed[unit.body];
  const std::size_t first = rows.size();
  const std::span<const CollisionTet> tets(body.mesh->tets);
  const int begin = unit.component->begin, count = unit.component->end - begin;
  for (const auto& [node, depth, area] : submerged_nodes(tets.subspan(begin, count), at.x, half_space.normal, half_space.offset)) {
    if (!body.fixed.empty() && body.fixed[node]) continue;
    ContactRow row = plane_row(unit, plane, at.x[node], area, area * depth);
    row.sides[0] = {.body = unit.body, .tet = node};
    if (body.rigid) {
      set_rigid(row, 0, 1, *body.rigid);
    } else {
      row.sides[0].node_count = 1;
      row.sides[0].nodes[0] = node;
      row.sides[0].weights[0] = 1;
    }
    finish(row, at.v[node], 1, depth, unit.mass, unit.component->volume);
    rows.push_back(row);
  }
  share_mass(unit.mass, std::span(rows).subspan(first));
}

// The paper's volumes.
void Detector::meet_plane_raw(const Unit& unit, int plane, std::vector<ContactRow>& rows) const {
  const CollisionPlane& half_space = in.planes[plane];
  const std::size_t first = rows.size();
  for (int k = unit.component->begin; k < unit.component->end; ++k) {
    const CollisionTet& t = tet(unit, k);
    const Mat34 x = nodes(unit, t);
    const double depth = half_space.offset - (half_space.normal.transpose() * x).minCoeff();
    if (!(depth > 0)) continue;
    const OrientedTet shape = orient(x);
    if (!(shape.volume > 0)) continue;
    const HalfSpaceOverlap common = overlap(shape, half_space.normal, half_space.offset);
    if (common.volume == 0 || !(common.area > 0)) continue;
    ContactRow row = plane_row(unit, plane, common.centroid, common.area, common.volume);
    const Vec3 u = add_side(row, 0, 1, unit, t, barycentric(shape, row.point));
    finish(row, u, 1, depth, unit.mass, unit.component->volume);
    rows.push_back(row);
  }
  share_mass(unit.mass, std::span(rows).subspan(first));
}

// The arm is from where the centre of mass is when the row's point is where it is: part s of the way on.
void Detector::set_rigid(ContactRow& row, int side, double s, const RigidMotion& rigid) const {
  Vec3 moved = Vec3::Zero();
  if (!in.settings.raw_damping) moved = s * in.dt * (rigid.movable ? Vec3(rigid.v + in.dt * in.gravity) : rigid.v);
  row.sides[side].rigid = rigid.movable;
  row.sides[side].arm = row.point - rigid.p_WC - moved;
}

// Returns the side's part of the velocity u with which the bodies came here.
Vec3 Detector::add_side(ContactRow& row, int side, double at, const Unit& unit, const CollisionTet& t,
                        const Eigen::Vector4d& b) const {
  const CollisionBody& body = in.bodies[unit.body];
  const double sign = side == 0 ? 1 : -1;
  ContactSide& s = row.sides[side];
  s.body = unit.body;
  s.tet = t.id;
  Vec3 came = Vec3::Zero();
  for (int k = 0; k < 4; ++k) came += sign * b[k] * placed[unit.body].v[t.nodes[k]];
  if (body.rigid) {
    set_rigid(row, side, at, *body.rigid);
    if (!s.rigid) row.known_velocity += sign * (body.rigid->v + body.rigid->w.cross(s.arm));
    return came;
  }
  for (int k = 0; k < 4; ++k) {
    const int node = t.nodes[k];
    if (!body.fixed.empty() && body.fixed[node]) {
      row.known_velocity += sign * b[k] * body.v[node];
    } else {
      s.nodes[s.node_count] = node;
      s.weights[s.node_count++] = sign * b[k];
    }
  }
  return came;
}

void Detector::finish(ContactRow& row, const Vec3& u, double s, double depth, double mass, double volume) const {
  const ContactSettings& settings = in.settings;
  if (settings.raw_damping) {
    row.depth = depth;
    row.c_n = in.dt * settings.phi * row.area;
    row.target = 0;
    return;
  }
  row.depth = depth + s * in.dt * row.normal.dot(u);
  const bool debris = std::ranges::any_of(row.sides, [&](const ContactSide& side) { return is_fragment(side.body); });
  row.c_n = (debris ? kFragmentKappa : 1) * settings.kappa * mass * row.area / std::cbrt(volume * volume);
  const double tau = (debris ? kFragmentRecovery : 1) * settings.recovery_steps * in.dt;
  row.target = row.depth < 0 ? row.depth / in.dt : std::min(row.depth / tau, settings.max_recovery_speed);
}

Mat34 Detector::at_start(const Unit& unit, const CollisionTet& t) const {
  Mat34 x;
  for (int k = 0; k < 4; ++k) x.col(k) = in.bodies[unit.body].x[t.nodes[k]];
  return x;
}

// A fast body may be more than half through a thin one where it is detected; the overlap's normal then points on, and
// would push it out at the far side. Where the two tets were apart at the start of the step along their relative motion
// u, they must meet against it: the normal is turned round, the depth is minus the gap that was between them.
void Detector::turn_back(ContactRow& row, const Vec3& u, const Mat34& a, const Mat34& b) const {
  if (row.normal.dot(u) <= 0) return;
  if ((u.transpose() * a).maxCoeff() > (u.transpose() * b).minCoeff()) return;
  row.normal = -row.normal;
  const double gap = (row.normal.transpose() * a).minCoeff() - (row.normal.transpose() * b).maxCoeff();
  row.depth = -std::max(gap, 0.0);
  row.target = row.depth / in.dt;
}

// Runs job(k, rows) for k in [0, count) in parallel; the rows come in order of k.
template <class Job>
void append_rows(int count, const ThreadPool& pool, std::vector<ContactRow>& rows, Job job) {
  std::vector<std::vector<ContactRow>> found(count);
  pool.for_chunks(count, 4, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) job(k, found[k]);
  });
  for (const std::vector<ContactRow>& some : found) rows.insert(rows.end(), some.begin(), some.end());
}

}  // namespace

std::vector<ContactRow> detect(const DetectionInput& input, const ThreadPool& pool) {
  Detector detector{input, {}, {}};
  const int bodies = static_cast<int>(input.bodies.size());
  detector.placed.resize(bodies);
  pool.for_chunks(bodies, 4, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) detector.place(k);
  });
  for (int k = 0; k < bodies; ++k) detector.add_units(k);
  std::vector<Unit>& units = detector.units;

  // Broad phase, over components' boxes.
  std::vector<Box3> boxes;
  for (const Unit& unit : units) boxes.push_back(unit.box);
  std::vector<IndexPair> pairs = sweep_and_prune(boxes);
  std::erase_if(pairs, [&](const IndexPair& p) { return !detector.may_meet(units[p.first], units[p.second]); });
  std::vector<std::uint8_t> near(units.size(), 0);
  for (const auto& [a, b] : pairs) near[a] = near[b] = 1;
  for (std::size_t k = 0; k < units.size(); ++k) near[k] |= detector.self(units[k]) != nullptr;
  pool.for_chunks(static_cast<int>(units.size()), 16, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      if (near[k]) detector.fill_tet_boxes(units[k]);
  });

  // Narrow phase.
  std::vector<ContactRow> rows;
  append_rows(static_cast<int>(pairs.size()), pool, rows, [&](int k, std::vector<ContactRow>& found) {
    detector.meet(units[pairs[k].first], units[pairs[k].second], found);
  });
  append_rows(static_cast<int>(units.size()), pool, rows, [&](int k, std::vector<ContactRow>& found) {
    if (detector.self(units[k])) detector.meet_itself(units[k], pool, found);
  });
  append_rows(static_cast<int>(units.size()), pool, rows, [&](int k, std::vector<ContactRow>& found) {
    const Unit& unit = units[k];
    if (!detector.in_solve(unit) || unit.mass == kInfinity || unit.box.isEmpty()) return;
    for (int plane = 0; plane < static_cast<int>(input.planes.size()); ++plane) {
      const Vec3& n = input.planes[plane].normal;
      const double lowest = n.dot(unit.box.center()) - 0.5 * n.cwiseAbs().dot(unit.box.sizes());
      if (!(lowest < input.planes[plane].offset)) continue;
      input.settings.raw_damping ? detector.meet_plane_raw(unit, plane, found) : detector.meet_plane(unit, plane, found);
    }
  });
  number_pairs(rows);
  return rows;
}

double deepest(std::span<const ContactRow> rows) {
  double depth = 0;
  for (const ContactRow& row : rows) depth = std::max(depth, row.depth);
  return depth;
}

}  // namespace crumple::sim::contact
