#include "server/sim/contact/detect.h"

#include "server/sim/contact/detector.h"
#include "server/sim/contact/surface_depth.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace crumple::sim::contact {

namespace {

// The paper's rule for fast bodies (section 6): they are looked at at every sixth of their diagonal on their way.
constexpr double kFastPart = 1.0 / 6;
constexpr int kMaxSamples = 16;

// Contact of less than this part of V^(2/3) is as strong as of this: a corner or an edge, which comes with next to no area,
// would else sink in until it has one (in the pile of 64 cubes of 1 m, by V/A: 53 mm at rest instead of 13, at the same
// cost). Twice as much leaves 9 mm, and heaps that creep on their corners for longer than 25 s.
constexpr double kLeastPatch = 0.05;

// Velocities that differ by more than this part of a body's thickness in a step are those of two courses.
constexpr double kNewCourse = 0.05;

// With which a soft node is looked for at the end of the step: the mean of its last two steps' velocities. What goes up in one step
// and down in the next is looked for where it is; by its last velocity alone it would be three times as far out, so that contact
// under a corner is found in every second step and keeps it going (by a millimetre, 30 times a second). What has been thrown, turned
// or stopped is looked for with its new velocity: on the mean of both it could pass through something thin unseen.
Vec3 settled_velocity(const Vec3& v, const Vec3& before, double new_course) {
  return (v - before).squaredNorm() > new_course * new_course ? v : Vec3(0.5 * (v + before));
}

double thickness(const CollisionMesh& mesh) {
  double least = kInfinity;
  for (const CollisionComponent& component : mesh.components) least = std::min(least, component.thickness);
  return least;
}

// Boundary tets of a unit that reach into a box.
struct Near {
  std::vector<int> tets;  // in CollisionMesh::tets
  std::vector<Box3> boxes;

  void assign(const Detector& d, const Unit& unit, const Box3& zone, double s) {
    detector_ = &d;
    unit_ = &unit;
    s_ = s;
    tets.clear();
    boxes.clear();
    const int begin = unit.component->begin, count = static_cast<int>(unit.tet_boxes.size());
    for (int bundle = 0; bundle < static_cast<int>(unit.bundles.size()); ++bundle) {
      if (!unit.bundles[bundle].intersects(zone)) continue;
      for (int k = kBundle * bundle; k < std::min(kBundle * (bundle + 1), count); ++k)
        if (unit.tet_boxes[k].intersects(zone)) tets.push_back(begin + k);
    }
    boxes.reserve(tets.size());
    for (const int tet : tets) boxes.push_back(unit.fast || s != 1 ? box_of(tet) : unit.tet_boxes[tet - begin]);
    if (shapes_.size() < tets.size()) shapes_.resize(tets.size());
    for (std::size_t i = 0; i < tets.size(); ++i) shapes_[i].volume = 0;
  }

  // Of those that are asked for alone: most reach into no box of the other unit.
  const OrientedTet& shape(int i) {
    if (shapes_[i].volume == 0) shapes_[i] = orient(nodes(tets[i]));  // not asked for yet, or flat
    return shapes_[i];
  }

 private:
  Mat34 nodes(int tet) const { return detector_->nodes_at(*unit_, detector_->tet(*unit_, tet), s_); }
  Box3 box_of(int tet) const {
    const Mat34 x = nodes(tet);
    return {x.rowwise().minCoeff(), x.rowwise().maxCoeff()};
  }

  const Detector* detector_ = nullptr;
  const Unit* unit_ = nullptr;
  double s_ = 1;
  std::vector<OrientedTet> shapes_;
};

void number_pairs(std::span<ContactRow> rows) {
  int pair = -1;
  for (ContactRow& row : rows) row.pair = pair += row.pair;
}

// At least of any of its nodes, at most sqrt(3) times that [m].
double largest_move(const Unit& unit) {
  return unit.moves.isEmpty() ? 0 : unit.moves.min().cwiseAbs().cwiseMax(unit.moves.max().cwiseAbs()).norm();
}

double reduced_mass(double a, double b) { return a == kInfinity ? b : b == kInfinity ? a : a * b / (a + b); }

constexpr int kJobsPerChunk = 4;

// Runs job(k, rows) for k in [0, count) in parallel, with no rows to begin with; the rows come in order of k. found: one a chunk.
template <class Job>
void append_rows(int count, const ThreadPool& pool, std::vector<std::vector<ContactRow>>& found, std::vector<ContactRow>& rows, Job job) {
  const std::size_t chunks = static_cast<std::size_t>((count + kJobsPerChunk - 1) / kJobsPerChunk);
  if (found.size() < chunks) found.resize(chunks);
  const auto run = [&](int begin, int end) {
    thread_local std::vector<ContactRow> own;
    std::vector<ContactRow>& some = found[begin / kJobsPerChunk];
    some.clear();
    for (int k = begin; k < end; ++k) {
      own.clear();
      job(k, own);
      some.insert(some.end(), own.begin(), own.end());
    }
  };
  pool.for_chunks(count, kJobsPerChunk, std::cref(run));
  std::size_t all = rows.size();
  for (std::size_t c = 0; c < chunks; ++c) all += found[c].size();
  rows.reserve(all);
  for (std::size_t c = 0; c < chunks; ++c) rows.insert(rows.end(), found[c].begin(), found[c].end());
}

}  // namespace

void Detector::place(int body) {
  const CollisionBody& source = in.bodies[body];
  PlacedBody& out = placed[body];
  const std::size_t n = source.x.size();
  const bool raw = in.settings.raw_damping;
  const bool settles = !raw && !source.rigid && source.v_before.size() == n;
  const double new_course = settles ? kNewCourse * thickness(*source.mesh) / in.dt : 0;
  const Vec3 fall = in.dt * in.gravity;
  out.x.resize(n);
  out.v.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const RigidMotion* rigid = source.rigid ? &*source.rigid : nullptr;
    const bool falls = rigid ? rigid->movable : source.fixed.empty() || !source.fixed[i];
    out.v[i] = rigid ? Vec3(rigid->v + rigid->w.cross(source.x[i] - rigid->p_WC)) : source.v[i];
    if (settles && falls) out.v[i] = settled_velocity(source.v[i], source.v_before[i], new_course);
    if (falls && !raw) out.v[i] += fall;
    out.x[i] = source.x[i];
    if (!raw) out.x[i] += in.dt * out.v[i];
  }
}

void Unit::clear() {
  std::vector<Box3> kept[] = {std::move(tet_boxes), std::move(bundles), std::move(way_boxes)};
  *this = {};
  for (std::vector<Box3>& boxes : kept) boxes.clear();
  tet_boxes = std::move(kept[0]);
  bundles = std::move(kept[1]);
  way_boxes = std::move(kept[2]);
}

Unit& Detector::add_unit() {
  if (static_cast<int>(units.size()) == unit_count) units.emplace_back();
  Unit& unit = units[unit_count++];
  unit.clear();
  return unit;
}

void Detector::add_units(int body) {
  const CollisionBody& source = in.bodies[body];
  for (const CollisionComponent& component : source.mesh->components) {
    Unit& unit = add_unit();
    unit.body = body;
    unit.component = &component;
    unit.mass = component.mass;
    bool free = source.rigid && source.rigid->movable;
    const std::span<const int> nodes = source.mesh->nodes_of(component);
    for (const int node : nodes) {
      const Vec3 &now = source.x[node], &then = placed[body].x[node];
      const Vec3 move = then - now;
      unit.box.extend(then);
      unit.moves.extend(move);
      unit.way_box.extend(now);
      unit.move += move;
      if (!source.rigid) free = free || source.fixed.empty() || !source.fixed[node];
    }
    if (source.rigid) unit.mass = source.rigid->mass;
    if (!free) unit.mass = kInfinity;
    unit.way_box.extend(unit.box);
    unit.move /= std::max<double>(1, static_cast<double>(nodes.size()));
    unit.diagonal = unit.box.isEmpty() ? 0 : unit.box.diagonal().norm();
    unit.fast = !in.settings.raw_damping && unit.move.norm() > kFastPart * unit.diagonal;
    if (unit.fast)
      for (const int node : nodes) unit.box.extend(source.x[node]);
  }
}

bool Detector::may_meet(const Unit& a, const Unit& b) const {
  if (a.body == b.body && in.bodies[a.body].rigid) return false;
  return (in_solve(a) || in_solve(b)) && (a.mass < kInfinity || b.mass < kInfinity);
}

void Detector::fill_tet_boxes(Unit& unit) const {
  unit.tet_boxes.clear();
  unit.tet_boxes.reserve(unit.component->boundary_end - unit.component->begin);
  for (int k = unit.component->begin; k < unit.component->boundary_end; ++k) {
    const Mat34 x = nodes(unit, tet(unit, k));
    unit.tet_boxes.emplace_back(x.rowwise().minCoeff(), x.rowwise().maxCoeff());
    if (!unit.fast) continue;
    const Mat34 start = at_start(unit, tet(unit, k));
    unit.tet_boxes.back().extend(Vec3(start.rowwise().minCoeff())).extend(Vec3(start.rowwise().maxCoeff()));
  }
  unit.bundles.assign((unit.tet_boxes.size() + kBundle - 1) / kBundle, Box3());
  for (std::size_t k = 0; k < unit.tet_boxes.size(); ++k) unit.bundles[k / kBundle].extend(unit.tet_boxes[k]);
}

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
  thread_local Near near_a, near_b;
  thread_local std::vector<IndexPair> pairs;
  thread_local FoundRows found;
  near_a.assign(*this, a, zone, s);
  near_b.assign(*this, b, zone, s);
  found.clear();
  sweep_and_prune(near_a.boxes, near_b.boxes, pairs);

  const Share share = share_of(a, b);
  for (const auto& [i, j] : pairs) {
    const CollisionTet &tet_a = tet(a, near_a.tets[i]), &tet_b = tet(b, near_b.tets[j]);
    if (a.body == b.body && share_a_node(tet_a.nodes, tet_b.nodes)) continue;
    meet_tets(s, {a, tet_a, near_a.shape(i)}, {b, tet_b, near_b.shape(j)}, share, found);
  }
  if (!in.settings.raw_damping) found.leave_out_slivers();
  found.append_to(rows, found.certain);
  share_out(share, rows);
}

Share Detector::share_of(const Unit& a, const Unit& b) const {
  const double volume_a = a.mass < kInfinity ? a.component->volume : kInfinity;
  const double volume_b = b.mass < kInfinity ? b.component->volume : kInfinity;
  return {reduced_mass(a.mass, b.mass), std::min(volume_a, volume_b)};
}

void Detector::share_out(const Share& share, std::span<ContactRow> rows) const {
  if (rows.empty()) return;
  double area = 0;
  for (const ContactRow& row : rows) area += row.area;
  for (ContactRow& row : rows) row.mass = share.mass * row.area / area;
  rows.front().pair = 1;
  const double least = kLeastPatch * std::cbrt(share.volume * share.volume);
  if (in.settings.raw_damping || area >= least) return;
  for (ContactRow& row : rows) row.c_n *= least / std::max(area, 1e-9 * least);
}

// Contact of two tets at part s of the step's way. Depth goes by the surfaces of two soft bodies. It is V/A on the way of what is fast,
// where surfaces are anywhere in each other; and of rigid bodies, shards and pieces of one body: with these, too, the lab's panel took two
// or three times as long at some tolerances.
void Detector::meet_tets(double s, const TetOfUnit& a, const TetOfUnit& b, const Share& share, FoundRows& found) const {
  if (!(a.shape.volume > 0 && b.shape.volume > 0)) return;
  const TetOverlap common = overlap(a.shape, b.shape);
  if (common.volume == 0) return;
  const bool raw = in.settings.raw_damping;
  const ContactNormal normal = contact_normal(common, a.shape, b.shape, a.tet.exterior, b.tet.exterior);
  const double area = normal.r.norm();
  ContactRow row;
  const bool by_surface = !raw && !are_pieces_of_one(a.unit, b.unit) && !in.bodies[a.unit.body].rigid && !in.bodies[b.unit.body].rigid;
  row.area = by_surface ? normal.weight * area : area;
  if (!(row.area > 0)) return;
  row.normal = normal.r / area;
  row.point = common.centroid;
  row.volume = common.volume;
  set_friction(row, in.bodies[a.unit.body].friction, in.bodies[b.unit.body].friction);
  const Vec3 u = add_side(row, 0, s, a.unit, a.tet, barycentric(a.shape, row.point)) +
                 add_side(row, 1, s, b.unit, b.tet, barycentric(b.shape, row.point));
  const double depth = by_surface && !a.unit.fast && !b.unit.fast
                           ? surface_depth(common, area, row.normal, {a.shape, a.tet.exterior}, {b.shape, b.tet.exterior})
                           : overlap_depth(common.volume, area);
  finish(row, u, s, depth, share.mass, share.volume);
  if (!raw) turn_back(row, u, at_start(a.unit, a.tet), at_start(b.unit, b.tet));
  found.push(row, {&a.tet, &b.tet}, normal.from_surface);
  found.certain |= normal.from_surface && (!by_surface || normal.weight == 1);
}

struct DetectionMemory::Vectors {
  std::vector<PlacedBody> placed;
  std::vector<Unit> units;
  std::vector<Box3> boxes;
  std::vector<IndexPair> pairs;
  std::vector<std::uint8_t> near, passing;
  std::vector<std::vector<ContactRow>> found;
};

DetectionMemory::DetectionMemory() : vectors_(std::make_unique<Vectors>()) {}
DetectionMemory::~DetectionMemory() = default;

std::vector<ContactRow> detect(const DetectionInput& input, const ThreadPool& pool) {
  DetectionMemory memory;
  std::vector<ContactRow> rows;
  detect(input, pool, memory, rows);
  return rows;
}

namespace {

bool may_meet_anything(const DetectionInput& input) {
  std::size_t units = 0;
  for (const CollisionBody& body : input.bodies) {
    if (body.self) return true;
    units += body.mesh->components.size();
  }
  return units > 1 || (units == 1 && !input.planes.empty());
}

}  // namespace

void detect(const DetectionInput& input, const ThreadPool& pool, DetectionMemory& memory, std::vector<ContactRow>& rows) {
  auto& [placed, all_units, boxes, pairs, near, passing, found] = *memory.vectors_;
  rows.clear();
  if (!may_meet_anything(input)) return;
  Detector detector{input, placed, all_units};
  const int bodies = static_cast<int>(input.bodies.size());
  if (static_cast<int>(placed.size()) < bodies) placed.resize(bodies);
  const auto place = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) detector.place(k);
  };
  pool.for_chunks(bodies, 4, std::cref(place));
  for (int k = 0; k < bodies; ++k) detector.add_units(k);
  const std::span<Unit> units(all_units.data(), detector.unit_count);

  // Broad phase, over components' boxes; what is faster than the thinnest of them is thick may miss it on its way.
  double thinnest = kInfinity;
  for (const Unit& unit : units) thinnest = std::min(thinnest, unit.component->thickness);
  boxes.clear();
  for (const Unit& unit : units) boxes.push_back(2 * largest_move(unit) > thinnest ? unit.way_box : unit.box);
  sweep_and_prune(boxes, pairs);
  near.assign(units.size(), 0);
  passing.assign(units.size(), 0);
  std::erase_if(pairs, [&](const IndexPair& p) {
    const Unit &a = units[p.first], &b = units[p.second];
    if (!detector.may_meet(a, b)) return true;
    const bool meet = a.box.intersects(b.box), pass = detector.may_pass(a, b);
    near[p.first] |= meet, near[p.second] |= meet;
    passing[p.first] |= pass, passing[p.second] |= pass;
    return !meet && !pass;
  });
  for (std::size_t k = 0; k < units.size(); ++k) near[k] |= detector.self(units[k]) != nullptr;
  const auto fill_boxes = [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      if (near[k]) detector.fill_tet_boxes(units[k]);
      if (passing[k]) detector.fill_way_boxes(units[k]);
    }
  };
  pool.for_chunks(static_cast<int>(units.size()), 16, std::cref(fill_boxes));

  // Narrow phase.
  append_rows(static_cast<int>(pairs.size()), pool, found, rows, [&](int k, std::vector<ContactRow>& own) {
    detector.meet_pair(units[pairs[k].first], units[pairs[k].second], own);
  });
  append_rows(static_cast<int>(units.size()), pool, found, rows, [&](int k, std::vector<ContactRow>& own) {
    if (detector.self(units[k])) detector.meet_itself(units[k], pool, own);
  });
  append_rows(static_cast<int>(units.size()), pool, found, rows, [&](int k, std::vector<ContactRow>& own) {
    const Unit& unit = units[k];
    if (!detector.in_solve(unit) || unit.mass == kInfinity || unit.box.isEmpty()) return;
    for (int plane = 0; plane < static_cast<int>(input.planes.size()); ++plane) {
      const Vec3& n = input.planes[plane].normal;
      const double lowest = n.dot(unit.box.center()) - 0.5 * n.cwiseAbs().dot(unit.box.sizes());
      if (!(lowest < input.planes[plane].offset)) continue;
      input.settings.raw_damping ? detector.meet_plane_raw(unit, plane, own) : detector.meet_plane(unit, plane, own);
    }
  });
  number_pairs(rows);
}

double deepest(std::span<const ContactRow> rows) {
  double depth = 0;
  for (const ContactRow& row : rows) depth = std::max(depth, row.depth);
  return depth;
}

}  // namespace crumple::sim::contact
