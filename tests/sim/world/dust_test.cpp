#include "server/sim/bodies/dust.h"

#include <gtest/gtest.h>

#include <limits>

namespace crumple::sim {
namespace {

TornFace face(double size, double density, const Vec3& v = Vec3::Zero()) {
  return {.x = {Vec3::Zero(), Vec3(size, 0, 0), Vec3(0, size, 0)}, .v = {v, v, v}, .density = density};
}

TEST(DustOfFaces, HasTheNumberOfItsAreaAndMovesWithIt) {
  const auto grains = dust({face(1, 100, Vec3(1, 2, 3)), face(2, 50, Vec3(1, 2, 3))}, 7);
  EXPECT_NEAR(static_cast<double>(grains.size()), 0.5 * 100 + 2 * 50, 1);
  for (const DustParticle& grain : grains) {
    EXPECT_LT((grain.velocity - Vec3f(1, 2, 3)).norm(), 1e-6f);
    EXPECT_GE(grain.position.minCoeff(), 0);
    EXPECT_LE(grain.position.sum(), 2.000001f);
  }
}

TEST(DustOfFaces, IsSpreadEvenly) {
  Vec3f mean = Vec3f::Zero();
  int in_corner = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto grains = dust({face(1, 600)}, seed);
    ASSERT_NEAR(static_cast<double>(grains.size()), 300, 1);
    for (const DustParticle& grain : grains) {
      mean += grain.position / 12000.0f;
      in_corner += grain.position.x() > 0.5f;
    }
  }
  EXPECT_NEAR(mean.x(), 1.0 / 3, 0.01);  // three standard errors: 0.0065
  EXPECT_NEAR(mean.y(), 1.0 / 3, 0.01);
  EXPECT_NEAR(in_corner / 12000.0, 0.25, 0.012);
}

TEST(DustOfFaces, ManyFacesShareWhatIsAllowedAlike) {
  std::vector<TornFace> faces(100, face(1, 1000));
  for (std::size_t f = 50; f < 100; ++f)
    for (Vec3& x : faces[f].x) x.z() = 1;
  const auto grains = dust(faces, 3);
  EXPECT_LE(grains.size(), static_cast<std::size_t>(kMaxDust));
  EXPECT_GE(grains.size(), static_cast<std::size_t>(kMaxDust) - 1);
  EXPECT_NEAR(static_cast<double>(std::ranges::count_if(grains, [](const DustParticle& g) { return g.position.z() > 0.5f; })), kMaxDust / 2.0, 2);
}

TEST(DustOfFaces, IsTheSameForTheSameSeedAndNoneForWhatIsNotFinite) {
  const auto a = dust({face(1, 90)}, 5), b = dust({face(1, 90)}, 5), c = dust({face(1, 90)}, 6);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].position, b[k].position);
  EXPECT_NE(a.front().position, c.front().position);
  TornFace lost = face(1, 1e6);
  lost.x[1].x() = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(dust({lost}, 1).empty());
}

}  // namespace
}  // namespace crumple::sim
