#include "server/sim/linear_solver/level_transfer.h"

#include "server/sim/mesh/disjoint_sets.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace crumple::sim::linear_solver {
namespace {

constexpr double kSameShare = 1e-6;      // of the extent: coordinates closer than this are one plane
constexpr double kSmallestWeight = 1e-3; // below: the point stands on the lattice's face
constexpr float kFaint = 0.35f;          // total weight of a coarse point below which it is none
constexpr int kSmallPiece = 12;          // points of a coarse level that move as one rather than not getting fewer
constexpr std::size_t kMostPlanes = 100'000;

// The distance of neighbouring planes if the coordinates along an axis stand on equidistant planes, else 0.
double plane_gap(std::span<const Vec3> X, int axis) {
  std::vector<double> values;
  values.reserve(X.size());
  for (const Vec3& p : X) values.push_back(p[axis]);
  std::sort(values.begin(), values.end());
  const double tolerance = kSameShare * (values.back() - values.front());
  values.erase(std::unique(values.begin(), values.end(), [&](double a, double b) { return b - a <= tolerance; }), values.end());
  if (values.size() < 2 || values.size() > kMostPlanes) return 0;
  const double gap = (values.back() - values.front()) / static_cast<double>(values.size() - 1);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::abs(values[k] - values.front() - static_cast<double>(k) * gap) > 0.01 * gap) return 0;
  }
  return gap;
}

// A fine point's share in one lattice point.
struct Share {
  std::int64_t key = 0;  // of the lattice point
  float weight = 0;
};
struct Shares {
  std::array<Share, 4> entry;
  int count = 0;
};

constexpr std::int64_t kBias = 1 << 20;

std::int64_t key_of(const std::array<std::int64_t, 3>& c) {
  return ((c[0] + kBias) << 42) | ((c[1] + kBias) << 21) | (c[2] + kBias);
}

Vec3 lattice_point(std::int64_t key, const CoarseLattice& lattice) {
  constexpr std::int64_t kMask = (1 << 21) - 1;
  const Vec3 c(static_cast<double>((key >> 42) - kBias), static_cast<double>(((key >> 21) & kMask) - kBias),
               static_cast<double>((key & kMask) - kBias));
  return lattice.origin + c.cwiseProduct(lattice.spacing);
}

// Barycentric coordinates in the Kuhn tet around a point: from the cell's lowest corner along the axes, that of the
// largest fraction first.
Shares shares_of(const Vec3& X, const CoarseLattice& lattice) {
  const Vec3 s = (X - lattice.origin).cwiseQuotient(lattice.spacing);
  std::array<std::int64_t, 3> corner;
  std::array<double, 3> f;
  for (int a = 0; a < 3; ++a) {
    corner[a] = static_cast<std::int64_t>(std::floor(s[a]));
    f[a] = s[a] - static_cast<double>(corner[a]);
    if (f[a] > 1 - kSmallestWeight) ++corner[a], f[a] = 0;
    if (f[a] < kSmallestWeight) f[a] = 0;
  }
  std::array<int, 3> axis{0, 1, 2};
  std::stable_sort(axis.begin(), axis.end(), [&](int a, int b) { return f[a] > f[b]; });
  const double weights[4] = {1 - f[axis[0]], f[axis[0]] - f[axis[1]], f[axis[1]] - f[axis[2]], f[axis[2]]};
  Shares shares;
  double kept = 0;
  for (int k = 0; k < 4; ++k) {
    if (k > 0) ++corner[axis[k - 1]];
    if (weights[k] < kSmallestWeight) continue;
    shares.entry[shares.count++] = {key_of(corner), static_cast<float>(weights[k])};
    kept += weights[k];
  }
  for (int k = 0; k < shares.count; ++k) shares.entry[k].weight /= static_cast<float>(kept);
  return shares;
}

// Shares of touching points in one lattice point belong together. Returns the parents; share k of point i is 4 i + k.
std::vector<int> connect_shares(const std::vector<Shares>& shares, const LevelGraph& graph) {
  std::vector<int> parent(4 * shares.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (int i = 0; i < static_cast<int>(shares.size()); ++i) {
    for (int k = graph.row_start[i]; k < graph.row_start[i + 1]; ++k) {
      const int j = graph.columns[k];
      if (j > i) break;  // the pair comes again from the other side; columns ascend
      for (int a = 0; a < shares[i].count; ++a)
        for (int b = 0; b < shares[j].count; ++b) {
          if (shares[i].entry[a].key != shares[j].entry[b].key) continue;
          unite(parent, 4 * i + a, 4 * j + b);
        }
    }
  }
  return parent;
}

// Drops groups that hardly move anything, where their points have others: as unknowns they would say what those say.
void drop_faint(std::vector<Shares>& shares, std::span<const int> group, std::span<const char> held) {
  std::vector<float> sum(group.size(), 0);
  for (std::size_t i = 0; i < shares.size(); ++i)
    for (int k = 0; k < shares[i].count && !held[i]; ++k) sum[group[4 * i + k]] += shares[i].entry[k].weight;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    float kept = 0;
    int largest = 0;
    for (int k = 0; k < shares[i].count; ++k) {
      if (shares[i].entry[k].weight > shares[i].entry[largest].weight) largest = k;
      if (sum[group[4 * i + k]] >= kFaint) kept += shares[i].entry[k].weight;
    }
    for (int k = 0; k < shares[i].count; ++k) {
      float& weight = shares[i].entry[k].weight;
      if (kept == 0) weight = k == largest ? 1.0f : 0.0f;
      else weight = sum[group[4 * i + k]] >= kFaint ? weight / kept : 0.0f;
    }
  }
}

// A piece that the lattice would give more than half as many points as it has: so many unknowns may not be independent of
// each other. Nodes of such a piece move as one, without turning; points of a coarse level stay as they are.
void gather_small_pieces(const LevelGraph& graph, std::span<const char> held, bool finest, std::vector<Shares>& shares,
                         std::vector<int>& group) {
  const int n = static_cast<int>(shares.size());
  std::vector<int> piece(n);
  std::iota(piece.begin(), piece.end(), 0);
  for (int i = 0; i < n; ++i)
    for (int k = graph.row_start[i]; k < graph.row_start[i + 1] && graph.columns[k] < i; ++k) {
      unite(piece, i, graph.columns[k]);
    }
  std::vector<int> nodes(n, 0), groups(n, 0);
  std::vector<char> seen(group.size(), 0);
  for (int i = 0; i < n; ++i) {
    if (held[i]) continue;
    ++nodes[find_root(piece, i)];
    for (int k = 0; k < shares[i].count; ++k) {
      if (shares[i].entry[k].weight > 0 && !std::exchange(seen[group[4 * i + k]], 1)) ++groups[find_root(piece, i)];
    }
  }
  for (int i = 0; i < n; ++i) {
    const int p = find_root(piece, i);
    if (2 * groups[p] <= nodes[p]) continue;
    const int as = finest || nodes[p] <= kSmallPiece ? p : i;
    shares[i] = {{Share{shares[as].entry[0].key, 1.0f}}, 1};
    group[4 * i] = 4 * as;
  }
}

void fill_columns(LevelTransfer& t, int coarse_count) {
  t.column_start.assign(coarse_count + 1, 0);
  for (int c : t.coarse) ++t.column_start[c + 1];
  for (int c = 0; c < coarse_count; ++c) t.column_start[c + 1] += t.column_start[c];
  t.fine.resize(t.coarse.size());
  t.column_weight.resize(t.coarse.size());
  std::vector<int> next(t.column_start.begin(), t.column_start.end() - 1);
  for (int i = 0; i < t.fine_count(); ++i)
    for (int k = t.row_start[i]; k < t.row_start[i + 1]; ++k) {
      const int at = next[t.coarse[k]]++;
      t.fine[at] = i;
      t.column_weight[at] = t.weight[k];
    }
}

}  // namespace

CoarseLattice coarse_lattice(std::span<const Vec3> X, double mean_tet_volume) {
  assert(!X.empty() && mean_tet_volume > 0);
  Vec3 low = X.front();
  for (const Vec3& p : X) low = low.cwiseMin(p);
  // The edge of a cell of six tets; about the distance of nodes in any mesh of good tets.
  const double cell = std::cbrt(6 * mean_tet_volume);
  CoarseLattice lattice{low, Vec3::Constant(2 * cell)};
  for (int axis = 0; axis < 3; ++axis) {
    const double gap = plane_gap(X, axis);
    if (gap <= 0) continue;
    // Never more than a few planes: in a lattice of another kind planes lie closer than nodes.
    const double planes = std::clamp(std::round(2 * cell / gap), 2.0, 4.0);
    if (planes * gap >= cell) lattice.spacing[axis] = planes * gap;
  }
  return lattice;
}

LevelTransfer make_transfer(std::span<const Vec3> X, const LevelGraph& graph, std::span<const char> held,
                            const CoarseLattice& lattice, bool finest, std::vector<Vec3>& coarse_X) {
  const int n = static_cast<int>(X.size());
  assert(static_cast<int>(graph.row_start.size()) == n + 1 && static_cast<int>(held.size()) == n);
  std::vector<Shares> shares(n);
  for (int i = 0; i < n; ++i) shares[i] = shares_of(X[i], lattice);
  std::vector<int> group = connect_shares(shares, graph);  // of share 4 i + k
  for (int s = 0; s < 4 * n; ++s) group[s] = find_root(group, s);
  drop_faint(shares, group, held);
  gather_small_pieces(graph, held, finest, shares, group);

  // A group that moves something is a coarse point; they are numbered along the lattice.
  std::vector<char> used(group.size(), 0);
  std::vector<std::pair<std::int64_t, int>> points;  // lattice point, group
  for (int i = 0; i < n; ++i) {
    if (held[i]) continue;
    for (int k = 0; k < shares[i].count; ++k) {
      const int g = group[4 * i + k];
      if (shares[i].entry[k].weight > 0 && !std::exchange(used[g], 1)) points.push_back({shares[i].entry[k].key, g});
    }
  }
  std::sort(points.begin(), points.end());
  std::vector<int> id(group.size(), -1);
  coarse_X.clear();
  for (const auto& [key, g] : points) {
    id[g] = static_cast<int>(coarse_X.size());
    coarse_X.push_back(lattice_point(key, lattice));
  }

  LevelTransfer transfer;
  transfer.row_start.push_back(0);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < shares[i].count && !held[i]; ++k) {
      if (shares[i].entry[k].weight <= 0) continue;
      transfer.coarse.push_back(id[group[4 * i + k]]);
      transfer.weight.push_back(shares[i].entry[k].weight);
    }
    transfer.row_start.push_back(static_cast<int>(transfer.coarse.size()));
  }
  fill_columns(transfer, static_cast<int>(coarse_X.size()));
  return transfer;
}

}  // namespace crumple::sim::linear_solver
