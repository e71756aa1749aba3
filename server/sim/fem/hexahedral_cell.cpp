#include "server/sim/fem/hexahedral_cell.h"

#include "server/sim/fem/edge_star.h"
#include "server/sim/fem/rest_body.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace crumple::sim::fem {
namespace {

constexpr int kNone = -1;
constexpr std::size_t kTets = 6, kCorners = 8;
constexpr double kSameVolume = 0.05;  // of the tets and of the trilinear cell, relative: faces may be a little bent
constexpr int kOrigin = 0, kOpposite = 7;
// Around the diagonal in positive order, from any corner that an edge of the cell joins to the origin.
constexpr std::array<std::uint8_t, 6> kRing{1, 3, 2, 6, 4, 5};

// The nodes around the edge in positive order; none if the tets do not close around it.
std::optional<std::array<int, 6>> ring_of(const std::vector<Tet>& tets, const EdgeStar& star) {
  std::map<int, int> next;
  for (const int t : star.tets) {
    const auto [p, q] = around(tets[t], star.edge);
    if (!next.try_emplace(p, q).second) return {};
  }
  std::array<int, 6> ring;
  int node = next.begin()->first;
  for (int& r : ring) {
    r = node;
    const auto at = next.find(node);
    if (at == next.end()) return {};
    node = at->second;
  }
  std::array<int, 6> sorted = ring;
  std::ranges::sort(sorted);
  if (node != ring[0] || std::ranges::adjacent_find(sorted) != sorted.end()) return {};
  return ring;
}

// A cell before it is known whether its shape will do.
struct Candidate {
  std::array<int, 8> nodes;
  std::array<int, 6> tets;
  HexahedronTets corner;
  Mat38 X;  // from the origin
};

std::optional<Candidate> candidate(const std::vector<Tet>& tets, const RestBody& rest, const EdgeStar& star) {
  const auto ring = ring_of(tets, star);
  if (!ring) return {};
  std::map<int, Vec3> X;
  for (const int t : star.tets) {
    const Mat34 local = rest_nodes(rest, t);
    const auto origin = std::ranges::find(tets[t], star.edge[0]) - tets[t].begin();
    for (int a = 0; a < 4; ++a) X[tets[t][a]] = local.col(a) - local.col(origin);
  }
  // The corners beside the origin add up to the diagonal, those beside its other end to twice that.
  const auto miss = [&](int first) -> double {
    return (X[(*ring)[first]] + X[(*ring)[first + 2]] + X[(*ring)[first + 4]] - X[star.edge[1]]).norm();
  };
  const int first = miss(0) <= miss(1) ? 0 : 1;
  Candidate c;
  c.nodes[kOrigin] = star.edge[0];
  c.nodes[kOpposite] = star.edge[1];
  for (int k = 0; k < 6; ++k) c.nodes[kRing[k]] = (*ring)[(first + k) % 6];
  for (std::size_t a = 0; a < kCorners; ++a) c.X.col(a) = X[c.nodes[a]];
  std::ranges::copy(star.tets, c.tets.begin());
  for (std::size_t k = 0; k < kTets; ++k)
    for (int a = 0; a < 4; ++a)
      c.corner[k][a] = static_cast<std::uint8_t>(std::ranges::find(c.nodes, tets[c.tets[k]][a]) - c.nodes.begin());
  return c;
}

double filled_volume(const RestBody& rest, std::span<const int> tets) {
  double volume = 0;
  for (const int t : tets) volume += rest.fill[t] * rest.volume[t];
  return volume;
}

// -sqrt(V) g_a of the mean over the tets, by their true basis: V g_a is an area, however flat the tet.
std::array<Vec3, 8> mean_cores(const RestBody& rest, std::span<const int> tets, const HexahedronTets& corner) {
  const double volume = filled_volume(rest, tets);
  std::array<Vec3, 8> core;
  core.fill(Vec3::Zero());
  for (std::size_t k = 0; k < tets.size(); ++k) {
    const int t = tets[k];
    const Mat34 g = rest.gradients(t);
    for (int a = 0; a < 4; ++a) core[corner[k][a]] -= rest.fill[t] * rest.volume[t] / std::sqrt(volume) * g.col(a);
  }
  core[0].setZero();  // exactly: a translation strains nothing
  for (std::size_t a = 1; a < kCorners; ++a) core[0] -= core[a];
  return core;
}

// What a shape is made of, to a billionth: cells of a lattice share one.
using ShapeKey = std::vector<std::int64_t>;

ShapeKey key_of(const RestBody& rest, const Candidate& c) {
  ShapeKey key{rest.heterogeneous() ? rest.material_id[c.tets[0]] : 0};
  for (const double v : c.X.reshaped()) key.push_back(std::llround(1e9 * v / rest.mean_edge));
  for (const int t : c.tets) key.push_back(std::llround(1e9 * rest.fill[t]));
  for (const auto& tet : c.corner) key.insert(key.end(), tet.begin(), tet.end());
  return key;
}

std::optional<HexahedronShape> shape_of(const RestBody& rest, const Candidate& c) {
  const double filled = filled_volume(rest, c.tets);
  double volume = 0;
  for (const int t : c.tets) volume += rest.volume[t];
  if (std::abs(trilinear_volume(c.X) - volume) > kSameVolume * volume) return {};
  const std::array<Vec3, 8> core = mean_cores(rest, c.tets, c.corner);
  Mat38 g;
  for (std::size_t a = 0; a < kCorners; ++a) g.col(a) = -1 / std::sqrt(filled) * core[a];
  return hexahedron_shape(c.X, g, c.corner, rest.lame_of(c.tets[0]), filled, filled / volume);
}

bool of_one_material(const RestBody& rest, std::span<const int> tets) {
  return !rest.heterogeneous() || std::ranges::all_of(tets, [&](int t) { return rest.material_id[t] == rest.material_id[tets[0]]; });
}

void append(std::span<const int> tets, double volume, std::span<const int> nodes, std::span<const Vec3> core, MacroElements& made) {
  for (const int t : tets) made.of_tet[2 * t] = made.of_tet[2 * t + 1] = made.count();
  made.tets.insert(made.tets.end(), tets.begin(), tets.end());
  made.nodes.insert(made.nodes.end(), nodes.begin(), nodes.end());
  made.core.insert(made.core.end(), core.begin(), core.end());
  made.gamma.resize(made.nodes.size(), 0.0);
  made.volume.push_back(volume);
  made.tet_start.push_back(static_cast<int>(made.tets.size()));
  made.corner_start.push_back(static_cast<int>(made.nodes.size()));
}

// The nodes of a cell by its corners; none if tets have left it or do not agree.
std::optional<std::array<int, 8>> whole(const std::vector<Tet>& tets, const HexahedralCells& cells, std::span<const int> members) {
  if (members.size() != kTets) return {};
  std::array<int, 8> nodes;
  nodes.fill(kNone);
  for (const int t : members) {
    for (int a = 0; a < 4; ++a) {
      int& node = nodes[cells.corner[t][a]];
      if (node != kNone && node != tets[t][a]) return {};
      node = tets[t][a];
    }
  }
  return nodes;
}

}  // namespace

int make_cells(const std::vector<Tet>& tets, RestBody& rest) {
  HexahedralCells& cells = rest.macros.cells;
  cells = {};
  cells.corner.resize(tets.size());
  cells.order.resize(tets.size(), 0);
  cells.shape.resize(tets.size(), kNone);
  std::map<ShapeKey, int> known;  // kNone: will not do
  std::vector<int> cell(2 * tets.size());
  for (std::size_t t = 0; t < tets.size(); ++t) cell[2 * t] = cell[2 * t + 1] = static_cast<int>(tets.size() + t);
  int count = 0;
  for (const EdgeStar& star : edge_stars_by_length(tets, rest, [](int) { return true; })) {
    if (star.tets.size() != kTets || !of_one_material(rest, star.tets)) continue;
    if (std::ranges::any_of(star.tets, [&](int t) { return cells.shape[t] != kNone; })) continue;
    const auto c = candidate(tets, rest, star);
    if (!c) continue;
    const auto [at, fresh] = known.try_emplace(key_of(rest, *c), kNone);
    if (fresh) {
      if (auto shape = shape_of(rest, *c)) {
        at->second = static_cast<int>(cells.shapes.size());
        cells.shapes.push_back(std::move(*shape));
      }
    }
    if (at->second == kNone) continue;
    for (std::size_t k = 0; k < kTets; ++k) {
      const int t = c->tets[k];
      cells.corner[t] = c->corner[k];
      cells.order[t] = static_cast<std::uint8_t>(k);
      cells.shape[t] = at->second;
      cell[2 * t] = cell[2 * t + 1] = count;
    }
    ++count;
  }
  regroup_cells(tets, cell, rest);
  return count;
}

void regroup_cells(const std::vector<Tet>& tets, std::span<const int> before, RestBody& rest) {
  MacroElements made;
  made.cells = std::move(rest.macros.cells);
  made.of_tet.resize(2 * tets.size());
  made.tet_start = made.corner_start = {0};
  HexahedralCells& cells = made.cells;
  std::map<int, std::vector<int>> members;
  for (int t = 0; t < static_cast<int>(tets.size()); ++t)
    if (cells.shape[t] != kNone) members[before[2 * t]].push_back(t);
  for (auto& [id, own] : members) {
    const auto nodes = whole(tets, cells, own);
    if (!nodes) {
      for (const int t : own) cells.shape[t] = kNone;
      continue;
    }
    std::ranges::sort(own, {}, [&](int t) { return cells.order[t]; });
    HexahedronTets corner;
    for (std::size_t k = 0; k < kTets; ++k) corner[k] = cells.corner[own[k]];
    append(own, filled_volume(rest, own), *nodes, mean_cores(rest, own, corner), made);
  }
  made.hexahedra = made.count();
  for (int t = 0; t < static_cast<int>(tets.size()); ++t) {
    if (cells.shape[t] != kNone) continue;
    const Mat34 columns = rest.core(t);
    std::array<Vec3, 4> core;
    for (int a = 0; a < 4; ++a) core[a] = columns.col(a);
    append(std::span(&t, 1), rest.fill[t] * rest.volume[t], tets[t], core, made);
  }
  rest.macros = std::move(made);
}

}  // namespace crumple::sim::fem
