#pragma once

#include "server/sim/example_based/deform.h"
#include "server/sim/example_based/weights.h"
#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

namespace crumple::sim::example_based {

// A box of tets about the origin.
inline TetMesh bar_mesh(std::array<int, 3> cells, double H) {
  TetMesh mesh = test::kuhn_lattice(cells, H);
  for (Vec3& X : mesh.X) X -= 0.5 * H * Vec3(cells[0], cells[1], cells[2]);
  return mesh;
}

// Keeps the tets whose centroid satisfies `keep`, and the vertices they need.
inline TetMesh carve(const TetMesh& mesh, const std::function<bool(const Vec3&)>& keep) {
  TetMesh kept;
  std::vector<int> id(mesh.X.size(), -1);
  for (Tet tet : mesh.tets) {
    if (!keep((mesh.X[tet[0]] + mesh.X[tet[1]] + mesh.X[tet[2]] + mesh.X[tet[3]]) / 4)) continue;
    for (int& i : tet) {
      if (id[i] < 0) {
        id[i] = kept.node_count();
        kept.X.push_back(mesh.X[i]);
      }
      i = id[i];
    }
    kept.tets.push_back(tet);
  }
  return kept;
}

inline BoneTransform turn(double degrees, const Vec3& axis, const Vec3& t = Vec3::Zero()) {
  return {Quat(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized())), t};
}

// A set with weights by distance from `bones`; the rest pose, which is the identity, comes before `poses`.
inline std::shared_ptr<ExampleSet> make_set(TetMesh mesh, const std::vector<Vec3>& bones,
                                            const std::vector<std::vector<BoneTransform>>& poses) {
  auto set = std::make_shared<ExampleSet>();
  set->mesh = std::move(mesh);
  set->W = distance_weights(set->mesh.X, bones);
  set->examples.push_back({"rest", std::vector<BoneTransform>(bones.size())});
  for (const auto& pose : poses) set->examples.push_back({"pose " + std::to_string(set->examples.size()), pose});
  set->convex_parts.emplace_back();
  for (int i = 0; i < set->vertex_count(); ++i) set->convex_parts[0].push_back(i);
  return set;
}

// 0.6 x 0.6 x 1.6 m, three bones along z; examples: squashed, bent, dented on a side.
inline std::shared_ptr<ExampleSet> car(double scale = 1, int refine = 1) {
  TetMesh mesh = bar_mesh({3 * refine, 3 * refine, 8 * refine}, 0.2 * scale / refine);
  const std::vector<Vec3> bones{scale * Vec3(0, 0, -0.8), Vec3::Zero(), scale * Vec3(0, 0, 0.8)};
  return make_set(
      std::move(mesh), bones,
      {{turn(0, Vec3::UnitX(), scale * Vec3(0, 0, 0.2)), {}, turn(0, Vec3::UnitX(), scale * Vec3(0, 0, -0.3))},
       {turn(25, Vec3::UnitX()), {}, turn(-40, Vec3(1, 0.2, 0), scale * Vec3(0, 0.1, 0))},
       {{}, turn(15, Vec3::UnitY(), scale * Vec3(-0.25, 0, 0.05)), turn(10, Vec3::UnitZ())}});
}

inline WeightRow random_row(int examples, std::mt19937& random) {
  std::exponential_distribution<double> draw(1);  // uniform on the simplex after scaling
  WeightRow row(examples);
  for (int e = 0; e < examples; ++e) row[e] = draw(random);
  return row / row.sum();
}

inline Vec3 random_vector(std::mt19937& random) {
  std::normal_distribution<double> draw;
  return Vec3(draw(random), draw(random), draw(random));
}

// Worst |row sum - 1|, or infinity where an entry is outside [0, 1] or not a number.
inline double simplex_error(const Eigen::MatrixXd& E) {
  if (!((E.array() >= 0).all() && (E.array() <= 1).all())) return std::numeric_limits<double>::infinity();
  return (E.rowwise().sum().array() - 1).abs().maxCoeff();
}

}  // namespace crumple::sim::example_based
