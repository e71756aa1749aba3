#include "server/authoring/restricted_rig.h"

#include "server/authoring/convex_parts.h"
#include "server/sim/mesh/tet_tree.h"

#include <limits>
#include <numeric>

namespace crumple::authoring {
namespace {

using sim::example_based::ExampleSet;

int corner(const ExampleSet& asset, const PlaceInTet& place, int k) { return asset.mesh.tets[place.tet][k]; }

}  // namespace

PlaceInTet place_in_tet(const sim::TetMesh& mesh, int tet, const Vec3& p) {
  Eigen::Vector4d w = sim::barycentric(sim::rest_corners(mesh, tet), p);
  w = (w.array() < 1e-9).select(0, w);
  return {tet, w / w.sum()};
}

std::vector<int> restrict_rig(const ExampleSet& asset, std::span<const PlaceInTet> places, ExampleSet& part) {
  const auto N = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(N, asset.W.cols());
  for (Eigen::Index v = 0; v < N; ++v)
    for (int k = 0; k < 4; ++k) W.row(v) += places[v].weights[k] * asset.W.row(corner(asset, places[v], k));
  std::vector<int> bones;
  for (int b = 0; b < W.cols(); ++b)
    if (W.col(b).maxCoeff() > 0) bones.push_back(b);
  part.W = W(Eigen::all, bones);
  for (const auto& example : asset.examples) {
    part.examples.push_back({example.name, {}});
    for (const int b : bones) part.examples.back().bones.push_back(example.bones[b]);
  }
  if (!asset.handles.empty())
    for (const int b : bones) part.handles.push_back(asset.handles[b]);
  const auto scales = [&](const std::vector<double>& of_asset, std::vector<double>& of_part) {
    if (of_asset.empty()) return;
    for (const PlaceInTet& place : places) {
      of_part.push_back(0);
      for (int k = 0; k < 4; ++k) of_part.back() += place.weights[k] * of_asset[corner(asset, place, k)];
    }
  };
  scales(asset.alpha_scale, part.alpha_scale);
  scales(asset.beta_scale, part.beta_scale);
  return bones;
}

void restrict_hulls(const ExampleSet& asset, std::span<const PlaceInTet> places, ExampleSet& part) {
  const Vec3 far = Vec3::Constant(std::numeric_limits<double>::infinity());
  std::vector<int> all(places.size());
  std::iota(all.begin(), all.end(), 0);
  for (const std::vector<int>& hull : asset.convex_parts) {
    std::vector<char> in_hull(asset.mesh.X.size(), 0);
    for (const int v : hull) in_hull[v] = 1;
    std::vector<int> ids;
    for (const int v : all) {
      const auto belongs = [&](int k) { return places[v].weights[k] > 0 && in_hull[corner(asset, places[v], k)]; };
      if (belongs(0) || belongs(1) || belongs(2) || belongs(3)) ids.push_back(v);
    }
    if (auto of_part = hull_part_in_box(part.mesh.X, ids, -far, far); !of_part.empty())
      part.convex_parts.push_back(std::move(of_part));
  }
  if (!part.convex_parts.empty()) return;
  if (auto whole = hull_part_in_box(part.mesh.X, all, -far, far); !whole.empty())
    part.convex_parts.push_back(std::move(whole));
}

}  // namespace crumple::authoring
