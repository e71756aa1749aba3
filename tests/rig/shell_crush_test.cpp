#include "server/rig/shell_crush.h"

#include "server/authoring/example_author.h"
#include "server/rig/thin_shell.h"
#include "tests/rig/blocks_for_tests.h"
#include "tests/rig/rig_program.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

#include <cmath>

namespace crumple::rig {
namespace {

// A strip of equilateral triangles of edge `l`, hanging down from y = 0.
sim::SurfaceMesh lattice(double l, int rows, int columns) {
  sim::SurfaceMesh out;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) out.vertices.emplace_back(l * (c + 0.5 * (r % 2)), -r * l * std::sqrt(0.75), 0);
  const auto id = [&](int r, int c) { return r * (columns + 1) + c; };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int a = id(r, c), b = id(r, c + 1), d = id(r + 1, c), e = id(r + 1, c + 1);
      if (r % 2 == 0) {
        out.triangles.push_back({a, d, b});
        out.triangles.push_back({b, d, e});
      } else {
        out.triangles.push_back({a, d, e});
        out.triangles.push_back({a, e, b});
      }
    }
  return out;
}

// A lattice of equal springs k in equilateral triangles is an isotropic sheet with E t = 2 k / sqrt 3; with the shell's
// k = E t (A + A) / l^2 that is E t itself. So a strip of length L that hangs by its upper edge is longer by
// g L^2 / (2 c^2). 4 %: its edge cannot draw in, which makes the strip stiffer within about its width (a sixth of L).
TEST(ThinShell, AHangingStripStretchesAsABarOfItsModulus) {
  constexpr int kRows = 40, kColumns = 6;
  const sim::SurfaceMesh strip = lattice(0.03, kRows, kColumns);
  ThinShell shell(strip, {.wave_speed = 20, .bending = 0, .yield_strain = 1});
  for (int v = 0; v <= kColumns; ++v) shell.hold(v);
  for (int k = 0; k < 2 * 4800; ++k) shell.substep(1.0 / 4800, Vec3(0, -9.81, 0), 10, {});
  const double L = kRows * 0.03 * std::sqrt(0.75), wanted = 9.81 * L * L / (2 * 20 * 20);
  double longer = 0;
  for (int c = 0; c <= kColumns; ++c) {
    const int v = kRows * (kColumns + 1) + c;
    longer += (strip.vertices[v].y() - shell.x()[v].y()) / (kColumns + 1);
  }
  EXPECT_NEAR(longer, wanted, 0.04 * wanted);
}

// A spring pulled beyond its yield strain is left longer by what was beyond it.
TEST(ThinShell, WhatIsBeyondTheYieldStays) {
  sim::SurfaceMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0.5, 0.8, 0}}, {{0, 1, 2}}};
  ThinShell shell(triangle, {.wave_speed = 10, .bending = 0, .yield_strain = 0.02, .largest_stretch = 0.5});
  shell.x()[1].x() = 1.1;
  shell.flow();
  for (int k = 0; k < 4 * 2400; ++k) shell.substep(1.0 / 2400, Vec3::Zero(), 20, {});
  EXPECT_NEAR((shell.x()[1] - shell.x()[0]).norm(), 1.08, 1e-3);
}

double area(const std::vector<Vec3>& x, const std::vector<Triangle>& triangles) {
  double out = 0;
  for (const auto& [a, b, c] : triangles) out += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  return out;
}

double volume(const std::vector<Vec3>& x, const std::vector<Triangle>& triangles) {
  double out = 0;
  for (const auto& [a, b, c] : triangles) out += x[a].dot(x[b].cross(x[c])) / 6;
  return out;
}

// A hollow sheet keeps its area and gives up its volume; a solid keeps its volume.
TEST(ShellCrush, AShellFoldsWhereASolidSwells) {
  const auto set = block();
  const CrushOptions options{.axis = 0, .from_max = true, .depth = 0.3};
  const auto shell = shell_crush(set, "pressed", options), solid = crush(set, "pressed", options);
  ASSERT_TRUE(shell && solid);
  const auto& t = set.render.triangles;
  const auto &before = set.render.vertices, &folded = shell->copy.vertices, &swollen = solid->copy.vertices;
  ASSERT_EQ(folded.size(), before.size());
  EXPECT_NEAR(shell->report.thickness, 0.74, 0.05);  // it springs back farther than a solid
  EXPECT_NEAR(area(folded, t) / area(before, t), 1, 0.12);
  EXPECT_LT(volume(folded, t) / volume(before, t), 0.88);
  EXPECT_GT(volume(swollen, t) / volume(before, t), 0.9);
  EXPECT_GT(shell->report.plastic_strain, 0.02);
}

TEST(ShellCrush, AnElasticShellSpringsBack) {
  const auto crushed = shell_crush(block(), "pressed", {.axis = 1, .from_max = false, .depth = 0.1, .yield_strain = 1});
  ASSERT_TRUE(crushed) << crushed.error().text();
  EXPECT_NEAR(crushed->report.thickness, 1, 0.03);
  EXPECT_EQ(crushed->report.plastic_strain, 0);
}

TEST(ShellCrush, IsTheSameEachTimeAndFitsAPose) {
  auto set = block();
  const auto one = shell_crush(set, "a", {.depth = 0.3}), two = shell_crush(set, "a", {.depth = 0.3, .threads = 2});
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->copy.vertices, two->copy.vertices);
  const auto fitted = authoring::ExampleAuthor(set).add_copy(one->copy);
  ASSERT_TRUE(fitted) << fitted.error().text();
  EXPECT_LT(fitted->residual_rms, 0.06);  // of a body 2 m long, pressed by 0.6 m
  EXPECT_EQ(shell_crush(set, "a", {.depth = 0.7}).error().text(), "depth is 0.7, must be in (0, 0.6]");
}

TEST(ShellCrush, IsOneCommand) {
  const test::TemporaryFolder folder;
  const auto asset = (folder.path() / "block.crumple-asset").string();
  const auto [code, result] = run({"crush", folder.write("block.obj", kBlock).string(), "--shell", "--side", "+x",
                                   "--out", asset, "--tets", "300", "--depth", "0.25"});
  ASSERT_EQ(code, 0);
  EXPECT_LT(result["crushed"][0]["thickness"], 0.92);
  EXPECT_FALSE(result["crushed"][0].contains("inverted_tets"));
  EXPECT_EQ(run({"show", asset}).second["examples"], json({"rest", "pressed +x"}));
}

}  // namespace
}  // namespace crumple::rig
