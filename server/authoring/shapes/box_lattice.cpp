#include "server/authoring/shapes/box_lattice.h"

#include <algorithm>
#include <cmath>

#include "common/text.h"

namespace crumple::authoring {
namespace {

using Index = std::array<int, 3>;

struct Builder {
  const BoxLattice& box;
  sim::TetMesh mesh;

  int corner(const Index& c) const { return (c[0] * (box.cells[1] + 1) + c[1]) * (box.cells[2] + 1) + c[2]; }
  int centre(const Index& c) const {
    const int corners = (box.cells[0] + 1) * (box.cells[1] + 1) * (box.cells[2] + 1);
    return corners + (c[0] * box.cells[1] + c[1]) * box.cells[2] + c[2];
  }

  // Fractions along each axis -> position; the femfx lattice counts k towards -z.
  Vec3 position(double i, double j, double k) const {
    Vec3 s(i / box.cells[0], j / box.cells[1], k / box.cells[2]);
    if (box.lattice == Lattice::femfx) s.z() = 1 - s.z();
    return box.minimum + s.cwiseProduct(box.size);
  }

  template <class Visit>
  void for_each(const Index& n, const Visit& visit) const {
    for (int i = 0; i < n[0]; ++i)
      for (int j = 0; j < n[1]; ++j)
        for (int k = 0; k < n[2]; ++k) visit(Index{i, j, k});
  }

  void add_nodes() {
    for_each({box.cells[0] + 1, box.cells[1] + 1, box.cells[2] + 1},
             [&](const Index& c) { mesh.X.push_back(position(c[0], c[1], c[2])); });
    if (box.lattice == Lattice::bcc)
      for_each(box.cells, [&](const Index& c) { mesh.X.push_back(position(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5)); });
  }

  void add_tet(Tet tet) {
    mesh.tets.push_back(tet);
    if (sim::signed_volume(mesh, mesh.tet_count() - 1) < 0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
  }

  void add_femfx_cell(const Index& c) {
    std::array<int, 8> v;
    for (int up = 0; up < 2; ++up) {
      v[4 * up + 0] = corner({c[0], c[1] + up, c[2]});
      v[4 * up + 1] = corner({c[0] + 1, c[1] + up, c[2]});
      v[4 * up + 2] = corner({c[0] + 1, c[1] + up, c[2] + 1});
      v[4 * up + 3] = corner({c[0], c[1] + up, c[2] + 1});
    }
    constexpr Tet kTets[] = {{0, 1, 3, 4}, {1, 3, 4, 5}, {3, 5, 7, 4}, {1, 2, 3, 5}, {3, 2, 7, 5}, {2, 7, 5, 6}};
    for (const Tet& t : kTets) add_tet({v[t[0]], v[t[1]], v[t[2]], v[t[3]]});
  }

  void add_kuhn_cell(const Index& c) {
    constexpr Index kWays[] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (const Index& way : kWays) {
      Index at = c;
      Tet tet;
      tet[0] = corner(at);
      for (int k = 0; k < 3; ++k) {
        at[way[k]] += 1;
        tet[k + 1] = corner(at);
      }
      add_tet(tet);
    }
  }

  // Corners of the cell's face on its minimum (side 0) or maximum (side 1) side, around it.
  std::array<int, 4> face(Index c, int axis, int side) const {
    c[axis] += side;
    std::array<int, 4> out;
    constexpr int kAround[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    for (int q = 0; q < 4; ++q) {
      Index at = c;
      at[(axis + 1) % 3] += kAround[q][0];
      at[(axis + 2) % 3] += kAround[q][1];
      out[q] = corner(at);
    }
    return out;
  }

  void add_bcc_cell(const Index& c) {
    for (int axis = 0; axis < 3; ++axis) {
      if (c[axis] == 0) add_half_faces(c, axis, 0);
      if (c[axis] + 1 == box.cells[axis]) {
        add_half_faces(c, axis, 1);
        continue;
      }
      Index next = c;
      next[axis] += 1;
      const auto f = face(c, axis, 1);
      for (int q = 0; q < 4; ++q) add_tet({centre(c), centre(next), f[q], f[(q + 1) % 4]});
    }
  }

  // The diagonal alternates from cell to cell, so that the surface has no preferred direction.
  void add_half_faces(const Index& c, int axis, int side) {
    const auto f = face(c, axis, side);
    const int d = (c[0] + c[1] + c[2]) % 2;
    add_tet({centre(c), f[d], f[d + 1], f[d + 2]});
    add_tet({centre(c), f[d], f[d + 2], f[(d + 3) % 4]});
  }
};

Result<void> check(const BoxLattice& box) {
  for (int d = 0; d < 3; ++d) {
    if (!(box.size[d] > 0) || !std::isfinite(box.size[d]) || !std::isfinite(box.minimum[d]))
      return invalid("size", text("is ", box.size[d], " m, must be positive and finite"));
    if (box.cells[d] < 1) return invalid("cells", text("is ", box.cells[d], ", must be at least 1"));
  }
  const double tets = (box.lattice == Lattice::bcc ? 12.0 : 6.0) * box.cells[0] * box.cells[1] * box.cells[2];
  if (tets > sim::kMaxTets) return invalid("cells", text("give ", tets, " tets, must give at most ", sim::kMaxTets));
  return {};
}

}  // namespace

Result<sim::TetMesh> box_mesh(const BoxLattice& box) {
  if (auto valid = check(box); !valid) return std::unexpected(valid.error());
  Builder builder{box, {}};
  builder.add_nodes();
  builder.for_each(box.cells, [&](const Index& c) {
    switch (box.lattice) {
      case Lattice::femfx:
        return builder.add_femfx_cell(c);
      case Lattice::kuhn:
        return builder.add_kuhn_cell(c);
      case Lattice::bcc:
        return builder.add_bcc_cell(c);
    }
  });
  builder.mesh.X.shrink_to_fit();
  builder.mesh.tets.shrink_to_fit();
  return std::move(builder.mesh);
}

Result<sim::TetMesh> centred_box_mesh(const Vec3& size, const std::array<int, 3>& cells, Lattice lattice) {
  return box_mesh({.size = size, .cells = cells, .lattice = lattice, .minimum = -size / 2});
}

Result<sim::TetMesh> beam(const Vec3& size, const std::array<int, 3>& cells, Lattice lattice) {
  return box_mesh({.size = size, .cells = cells, .lattice = lattice, .minimum = Vec3(0, 0, -size.z())});
}

Result<sim::TetMesh> pane(double width, double height, double thickness, const std::array<int, 3>& cells,
                          Lattice lattice) {
  return centred_box_mesh({width, height, thickness}, cells, lattice);
}

}  // namespace crumple::authoring
