#include "server/authoring/splinter_cells.h"

#include "common/text.h"
#include "server/authoring/glass_shards.h"
#include "server/authoring/polyhedron.h"
#include "server/sim/scatter.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace crumple::authoring {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr double kMostCubes = 1e7;

Result<void> check_count(double count) {
  if (count <= kMaxSplinterCells) return {};
  return invalid("size", text("makes about ", count, " splinters, must make at most ", kMaxSplinterCells));
}

// Points of which each unit cube of a lattice has one, where it may be of use.
struct Sites {
  Box box;                    // around them
  std::array<int, 3> cubes;   // lattice cubes along each axis
  std::vector<int> of_cube;   // site of each, x first; -1: none
  std::vector<Vec3> points;

  int at(int i, int j, int k) const { return of_cube[i + cubes[0] * (j + cubes[1] * k)]; }
};

// In space y = A x, around a box of x. A point of the box has a site within the diagonal of a cube: sites that are further
// from the box have no part in it.
Result<Sites> scatter_sites(const Box& box, const Mat3& A, std::uint64_t seed) {
  Box scaled;
  for (int c = 0; c < 8; ++c) scaled.extend(A * box.corner(static_cast<Box::CornerType>(c)));
  Sites sites{scaled, {1, 1, 1}, {}, {}};
  double count = 1;
  for (int a = 0; a < 3; ++a) {
    const double cubes = std::max(1.0, std::ceil(scaled.sizes()[a]));
    if (auto fits = check_count(cubes); !fits) return std::unexpected(fits.error());
    count *= cubes;
    sites.cubes[a] = static_cast<int>(cubes);
  }
  if (count > kMostCubes) return std::unexpected(check_count(count).error());
  const Mat3 back = A.inverse();
  const auto is_far = [&](const Vec3& y) {
    const Vec3 x = back * y;
    for (int a = 0; a < 3; ++a)  // beyond a face of the box
      if (std::max(x[a] - box.max()[a], box.min()[a] - x[a]) > std::sqrt(3.0) * back.row(a).norm()) return true;
    return false;
  };
  std::mt19937_64 random(seed);
  for (int k = 0; k < sites.cubes[2]; ++k)
    for (int j = 0; j < sites.cubes[1]; ++j)
      for (int i = 0; i < sites.cubes[0]; ++i) {
        Vec3 y = scaled.min() + Vec3(i, j, k);
        for (double& coordinate : y) coordinate += sim::unit_interval(random());
        sites.of_cube.push_back(is_far(y) ? -1 : static_cast<int>(sites.points.size()));
        if (sites.of_cube.back() >= 0) sites.points.push_back(y);
      }
  if (auto fits = check_count(static_cast<double>(sites.points.size())); !fits) return std::unexpected(fits.error());
  return sites;
}

// The Voronoi cell of a site within the box: bisectors of sites in ever larger shells of lattice cubes, until none further
// away can reach it.
Polyhedron voronoi_cell(const Sites& sites, const std::array<int, 3>& cube) {
  const Vec3& p = sites.points[sites.at(cube[0], cube[1], cube[2])];
  Polyhedron cell = polyhedron_of(sites.box);
  const auto reach = [&] {
    double r = 0;
    for (const Vec3& corner : cell.points) r = std::max(r, (corner - p).norm());
    return r;
  };
  const int last = *std::ranges::max_element(sites.cubes);
  for (int shell = 1; shell <= last; ++shell) {
    const double far = 2 * reach();  // sites beyond it leave the cell as it is
    if (shell - 1 > far) break;
    std::array<int, 3> from, to;
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = std::max(0, cube[a] - shell);
      to[a] = std::min(sites.cubes[a] - 1, cube[a] + shell);
    }
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i) {
          if (std::max({std::abs(i - cube[0]), std::abs(j - cube[1]), std::abs(k - cube[2])}) != shell) continue;
          const int other = sites.at(i, j, k);
          if (other < 0) continue;
          const Vec3 way = sites.points[other] - p;
          if (way.norm() > far) continue;
          cell = clip(std::move(cell), way.normalized(), way.normalized().dot(p + way / 2), other);
        }
  }
  return cell;
}

// Voronoi cells in space y = A x.
Result<std::vector<SplinterCell>> voronoi_cells(const Box& box, const Mat3& A, std::uint64_t seed) {
  const auto sites = scatter_sites(box, A, seed);
  if (!sites) return std::unexpected(sites.error());
  const Mat3 back = A.inverse();
  std::vector<SplinterCell> cells;
  for (int k = 0; k < sites->cubes[2]; ++k)
    for (int j = 0; j < sites->cubes[1]; ++j)
      for (int i = 0; i < sites->cubes[0]; ++i) {
        const int site = sites->at(i, j, k);
        if (site < 0) continue;
        const Polyhedron found = voronoi_cell(*sites, {i, j, k});
        const Vec3& own = sites->points[site];
        SplinterCell cell;
        for (const Vec3& p : found.points) cell.box.extend(back * p);
        for (const Polyhedron::Face& face : found.faces) {
          if (face.label == Polyhedron::kOutside) continue;
          const Vec3 way = sites->points[face.label] - own;
          const Vec3 normal = A.transpose() * way;
          cell.walls.push_back({normal.normalized(), way.dot(own + way / 2) / normal.norm(), {face.label}});
        }
        cells.push_back(std::move(cell));
      }
  return cells;
}

}  // namespace

Result<std::vector<SplinterCell>> stone_cells(const Box& box, double size, std::uint64_t seed) {
  return voronoi_cells(box, Mat3::Identity() / size, seed);
}

Result<std::vector<SplinterCell>> glass_cells(const Box& box, double size, std::uint64_t seed) {
  int through = 0;
  box.sizes().minCoeff(&through);
  const int u = (through + 1) % 3, v = (through + 2) % 3;
  if (auto fits = check_count(2 * (box.sizes()[u] / size) * (box.sizes()[v] / size)); !fits) return std::unexpected(fits.error());
  const auto in_space = [&](const Eigen::Vector2d& p, double height) {
    Vec3 out;
    out[u] = p.x(), out[v] = p.y(), out[through] = height;
    return out;
  };
  std::vector<SplinterCell> cells;
  for (const Shard& shard : glass_shards({box.min()[u], box.min()[v]}, {box.max()[u], box.max()[v]}, size, seed)) {
    SplinterCell& cell = cells.emplace_back();
    for (const Eigen::Vector2d& p : shard.corners)
      for (const double height : {box.min()[through], box.max()[through]}) cell.box.extend(in_space(p, height));
    for (const Shard::Edge& edge : shard.edges)
      if (!edge.neighbours.empty()) cell.walls.push_back({in_space(edge.normal, 0), edge.offset, edge.neighbours});
  }
  return cells;
}

Result<std::vector<SplinterCell>> wood_cells(const Box& box, double size, double aspect, const Vec3& grain,
                                             std::uint64_t seed) {
  const Mat3 R = Quat::FromTwoVectors(grain, Vec3::UnitX()).toRotationMatrix();
  return voronoi_cells(box, Vec3(1 / (size * aspect), 1 / size, 1 / size).asDiagonal() * R, seed);
}

Result<std::vector<SplinterCell>> brick_cells(const Box& box, const Vec3& size) {
  std::array<int, 3> count;
  double all = 1;
  for (int a = 0; a < 3; ++a) {
    const double along = std::max(1.0, std::ceil(box.sizes()[a] / size[a] - 1e-9)) + (a == 0);  // one more where rows are shifted
    all *= along;
    if (auto fits = check_count(all); !fits) return std::unexpected(fits.error());
    count[a] = static_cast<int>(along);
  }
  const auto index = [&](int i, int j, int k) { return i + count[0] * (j + count[1] * k); };
  const auto shift = [](int j, int k) { return (j + k) % 2 == 0 ? 0.0 : -0.5; };
  std::vector<SplinterCell> cells;
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i) {
        const Vec3 low = box.min() + Vec3(i + shift(j, k), j, k).cwiseProduct(size);
        SplinterCell cell{Box(low, low + size), {}};
        const auto add = [&](int axis, int side, std::vector<int> neighbours) {
          if (neighbours.empty()) return;
          const Vec3 normal = side * Vec3::Unit(axis);
          cell.walls.push_back({normal, normal.dot(side > 0 ? cell.box.max() : cell.box.min()), std::move(neighbours)});
        };
        for (const int side : {-1, 1}) {
          if (i + side >= 0 && i + side < count[0]) add(0, side, {index(i + side, j, k)});
          for (const int axis : {1, 2}) {
            const int row = axis == 1 ? j + side : j, layer = axis == 2 ? k + side : k;
            if (row < 0 || row >= count[1] || layer < 0 || layer >= count[2]) continue;
            const int step = shift(j, k) == 0 ? 1 : -1;  // rows beside this one are shifted: two blocks of them meet it
            std::vector<int> met;
            for (const int other : {i, i + step})
              if (other >= 0 && other < count[0]) met.push_back(index(other, row, layer));
            add(axis, side, std::move(met));
          }
        }
        cells.push_back(std::move(cell));
      }
  return cells;
}

}  // namespace crumple::authoring
