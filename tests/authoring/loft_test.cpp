#include "server/authoring/shapes/loft.h"

#include "server/authoring/shapes/spacecraft.h"
#include "server/authoring/shapes/surfaces.h"

#include <gtest/gtest.h>

#include <numbers>

namespace crumple::authoring {
namespace {

TEST(Loft, EncloseWhatTheirFormulaSaysOnEveryAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    // An elliptic frustum: pi/4 h (A1 + A2 + sqrt(A1 A2)) / 3 with A = width x height; of 512 sides.
    const Loft cone{.axis = axis, .stations = {{-Vec3::Unit(axis), 2, 1}, {2 * Vec3::Unit(axis), 1, 0.5}}, .sides = 512};
    const double exact = std::numbers::pi / 4 * 3 * (2 + 0.5 + 1) / 3;
    EXPECT_NEAR(enclosed_volume(loft_surface(cone)), exact, 1e-4 * exact);
    EXPECT_EQ(loft_surface(cone).triangles.size(), 2u * 512 * 2);

    // Width and height lie as the header says.
    Eigen::AlignedBox3d box;
    for (const Vec3& p : loft_surface(cone).vertices) box.extend(p);
    const int width_axis = axis == 0 ? 2 : 0, height_axis = axis == 1 ? 2 : 1;
    EXPECT_NEAR(box.sizes()[width_axis], 2, 1e-3);
    EXPECT_NEAR(box.sizes()[height_axis], 1, 1e-3);
  }
}

TEST(Loft, IsClosed) {
  for (const sim::SurfaceMesh& mesh : {loft_surface(fighter_fuselage()), loft_surface(fighter_wing(-1)), loft_surface(fighter_wing(1))}) {
    EXPECT_GT(enclosed_volume(mesh), 0);
    Vec3 area = Vec3::Zero();
    for (const auto& [a, b, c] : mesh.triangles) area += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    EXPECT_LT(area.norm(), 1e-9);
  }
}

}  // namespace
}  // namespace crumple::authoring
