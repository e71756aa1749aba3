#include "server/authoring/bcc_lattice.h"

namespace crumple::authoring {
namespace {

// Corners of the face on the +axis side of a cell, as offsets along the two other axes, counter-clockwise about `axis`.
constexpr std::array<std::array<int, 2>, 4> kFace{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

std::array<int, 3> face_corner(std::array<int, 3> c, int axis, int k) {
  c[axis] += 1;
  c[(axis + 1) % 3] += kFace[k % 4][0];
  c[(axis + 2) % 3] += kFace[k % 4][1];
  return c;
}

std::array<int, 3> neighbour(std::array<int, 3> c, int axis) {
  c[axis] += 1;
  return c;
}

Vec3 as_vector(const std::array<int, 3>& c) { return Vec3(c[0], c[1], c[2]); }

std::int64_t flat(const std::array<int, 3>& c, int ny, int nz) { return (std::int64_t{c[0]} * ny + c[1]) * nz + c[2]; }

std::array<int, 3> unflat(std::int64_t id, int ny, int nz) {
  return {static_cast<int>(id / nz / ny), static_cast<int>(id / nz % ny), static_cast<int>(id % nz)};
}

}  // namespace

std::int64_t BccLattice::tet_id(const std::array<int, 3>& c, int axis, int quarter) const {
  return (flat(c, cells[1], cells[2]) * 3 + axis) * 4 + quarter;
}

BccLattice::Slot BccLattice::slot(std::int64_t tet) const {
  return {unflat(tet / 12, cells[1], cells[2]), static_cast<int>(tet / 4 % 3), static_cast<int>(tet % 4)};
}

bool BccLattice::exists(std::int64_t tet) const {
  const Slot s = slot(tet);
  return s.cell[s.axis] + 1 < cells[s.axis];
}

std::array<std::int64_t, 4> BccLattice::nodes(std::int64_t tet) const {
  const Slot s = slot(tet);
  const std::int64_t centres = node_slots() - cell_count();
  const auto centre = [&](const std::array<int, 3>& c) { return centres + flat(c, cells[1], cells[2]); };
  const auto corner = [&](int k) { return flat(face_corner(s.cell, s.axis, k), cells[1] + 1, cells[2] + 1); };
  return {centre(s.cell), centre(neighbour(s.cell, s.axis)), corner(s.quarter), corner(s.quarter + 1)};
}

std::array<Vec3, 4> BccLattice::unit_corners(const std::array<int, 3>& c, int axis, int quarter) const {
  const Vec3 half = Vec3::Constant(0.5);
  return {as_vector(c) + half, as_vector(neighbour(c, axis)) + half, as_vector(face_corner(c, axis, quarter)),
          as_vector(face_corner(c, axis, quarter + 1))};
}

std::array<Vec3, 4> BccLattice::corners(std::int64_t tet) const {
  const auto ids = nodes(tet);
  return {position(ids[0]), position(ids[1]), position(ids[2]), position(ids[3])};
}

Vec3 BccLattice::position(std::int64_t node) const {
  const std::int64_t centres = node_slots() - cell_count();
  if (node < centres) return origin + h * as_vector(unflat(node, cells[1] + 1, cells[2] + 1));
  return origin + h * (as_vector(unflat(node - centres, cells[1], cells[2])) + Vec3::Constant(0.5));
}

}  // namespace crumple::authoring
