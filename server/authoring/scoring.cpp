#include "server/authoring/scoring.h"

#include "common/text.h"
#include "server/sim/scatter.h"

#include <algorithm>
#include <array>

namespace crumple::authoring {
namespace {

using By = ScoreOptions::By;

// Sites that are uniform over the tets' volume.
std::vector<Vec3> sites_inside(const sim::TetMesh& mesh, int count, std::uint64_t seed) {
  std::vector<double> below;  // volume of each tet and those before it
  for (int t = 0; t < mesh.tet_count(); ++t)
    below.push_back(sim::signed_volume(mesh, t) + (below.empty() ? 0 : below.back()));
  std::uint64_t state = seed;
  const auto uniform = [&] { return sim::unit_interval(state = sim::scatter(state)); };
  std::vector<Vec3> out;
  for (int k = 0; k < count; ++k) {
    const auto at = std::ranges::upper_bound(below, uniform() * below.back());
    const int tet = static_cast<int>(std::min<std::ptrdiff_t>(at - below.begin(), mesh.tet_count() - 1));
    std::array<double, 5> cuts{0, uniform(), uniform(), uniform(), 1};  // of [0, 1] in four: uniform in a simplex
    std::ranges::sort(cuts);
    Vec3 site = Vec3::Zero();
    for (int c = 0; c < 4; ++c) site += (cuts[c + 1] - cuts[c]) * mesh.X[mesh.tets[tet][c]];
    out.push_back(site);
  }
  return out;
}

std::vector<ScorePlane> slabs(const Eigen::AlignedBox3d& box, int axis, int count) {
  std::vector<ScorePlane> out;
  for (int k = 1; k < count; ++k) out.push_back({Vec3::Unit(axis), box.min()[axis] + box.sizes()[axis] * k / count});
  return out;
}

Result<void> check(const ScoreOptions& o) {
  if (o.pieces < 2 || o.pieces > kMostPieces)
    return invalid("pieces", text("is ", o.pieces, ", must be in [2, ", kMostPieces, "]"));
  if (!(o.size >= 0 && o.size <= 1e6)) return invalid("size", text("is ", o.size, " m, must be in (0, 1e6]"));
  if (!(o.aspect >= 1 && o.aspect <= 1000)) return invalid("aspect", text("is ", o.aspect, ", must be in [1, 1000]"));
  if (!o.direction.allFinite() || o.direction.norm() > 1e6)
    return invalid("direction", "must be finite, at most 1e6 long");
  const bool given = o.block != Vec3::Zero();
  if (given && !(o.block.minCoeff() > 0 && o.block.maxCoeff() <= 1e6))
    return invalid("block",
                   text("is ", o.block.x(), " ", o.block.y(), " ", o.block.z(), " m, each must be in (0, 1e6]"));
  return {};
}

}  // namespace

Result<std::vector<SplinterCell>> scored_cells(const sim::example_based::ExampleSet& asset, const ScoreOptions& o) {
  if (auto ok = check(o); !ok) return std::unexpected(ok.error());
  Eigen::AlignedBox3d box;
  for (const Vec3& X : asset.mesh.X) box.extend(X);
  int longest = 0;
  box.sizes().maxCoeff(&longest);
  const double size = o.size > 0 ? o.size : box.sizes()[longest] * (o.by == By::wood ? 0.1 : 0.25);
  switch (o.by) {
    case By::planes:
      return plane_cells(box, o.planes.empty() ? slabs(box, longest, o.pieces) : o.planes);
    case By::voronoi:
      return voronoi_cells(box, sites_inside(asset.mesh, o.pieces, o.seed));
    case By::bricks:
      return brick_cells(box, o.block != Vec3::Zero() ? o.block : Vec3(size, size / 2, size / 2));
    case By::wood:
      return wood_cells(box, size, o.aspect,
                        o.direction.norm() > 0 ? Vec3(o.direction.normalized()) : Vec3(Vec3::Unit(longest)), o.seed);
    case By::stone:
      return stone_cells(box, size, o.seed);
    case By::glass:
      break;
  }
  return glass_cells(box, size, o.seed);
}

}  // namespace crumple::authoring
