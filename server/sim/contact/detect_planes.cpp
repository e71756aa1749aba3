#include "server/sim/contact/detector.h"
#include "server/sim/contact/submerged_nodes.h"

// Units against half-spaces.
namespace crumple::sim::contact {

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
  share_out({unit.mass, unit.component->volume}, std::span(rows).subspan(first));
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
  share_out({unit.mass, unit.component->volume}, std::span(rows).subspan(first));
}

}  // namespace crumple::sim::contact
