#pragma once

#include "server/authoring/rig_pipeline.h"

#include <gtest/gtest.h>

#include <map>

// What tests of pressing begin with.
namespace crumple::rig {

inline sim::SurfaceMesh subdivided(const sim::SurfaceMesh& coarse) {
  sim::SurfaceMesh fine{coarse.vertices, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(fine.vertices.size()));
    if (is_new) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]) / 2);
    return at->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Triangle& t : {Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) fine.triangles.push_back(t);
  }
  return fine;
}

// A block of 2 x 1 x 1 m about the origin, its surface of some 200 vertices.
inline sim::example_based::ExampleSet block() {
  authoring::ArtistMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.surface.vertices.emplace_back(k & 1 ? 1 : -1, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
  mesh.surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.surface = subdivided(subdivided(mesh.surface));
  authoring::RigOptions options{.enclosing = {.tet_budget = 500}};
  options.crushed = authoring::RigOptions::Crushed::never;
  auto made = authoring::make_asset(mesh, options);
  EXPECT_TRUE(made) << made.error().text();
  return std::move(made->set);
}

inline Vec3 extent(const std::vector<Vec3>& x) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : x) box.extend(p);
  return box.sizes();
}

}  // namespace crumple::rig
