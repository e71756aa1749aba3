// A piece that meets itself, in the solve.
#include <gtest/gtest.h>

#include "tests/sim/islands/soft_scene.h"
#include "tests/support/u_bar.h"

namespace crumple::sim::islands {
namespace {

constexpr double kH = 0.05;

// Arms 1 m long, 0.1 m thick and 0.2 m apart; so light and soft that they hold next to nothing up.
SoftBody& add_u(SoftScene& scene) {
  fem::FemMaterial material;
  material.young = 2e5;
  material.density = 50;
  return scene.add_mesh(test::u_bar(20, 2, 4, 4, kH), material, Vec3::Zero());
}

// From the lower face of the upper arm's tip to the upper face of the lower one's [m].
double opening(const SoftBody& u) {
  double above = 0, below = 0;
  int n = 0;
  for (std::size_t k = 0; k < u.mesh.X.size(); ++k) {
    const Vec3& X = u.mesh.X[k];
    if (X.x() < 22 * kH - 1e-9) continue;
    if (std::abs(X.y() - 6 * kH) < 1e-9) above += u.state.x[k].y(), ++n;
    if (std::abs(X.y() - 2 * kH) < 1e-9) below += u.state.x[k].y();
  }
  return (above - below) / n;
}

Vec3 angular_momentum(const SoftBody& body) {
  Vec3 L = Vec3::Zero();
  for (std::size_t i = 0; i < body.state.x.size(); ++i) L += body.rest.node_mass[i] * body.state.x[i].cross(body.state.v[i]);
  return L;
}

// Stands on the ground; its upper arm comes down by its own weight and then has 40 kg put on its tip, kilogram by kilogram.
SoftBody& add_loaded_u(SoftScene& scene, bool asks) {
  scene.dt = 1.0 / 120;
  scene.add_plane(Vec3::UnitY(), 0);
  SoftBody& u = add_u(scene);
  if (asks) u.meet_itself();
  scene.run(1.5);
  std::vector<int> tip;
  for (int k = 0; k < static_cast<int>(u.mesh.X.size()); ++k)
    if (u.mesh.X[k].x() > 18 * kH - 1e-9 && u.mesh.X[k].y() > 8 * kH - 1e-9) tip.push_back(k);
  for (int kilogram = 0; kilogram < 40; ++kilogram) {
    for (const int k : tip) u.rest.node_mass[k] += 1 / static_cast<double>(tip.size());
    scene.run(0.05);
  }
  scene.run(1);
  return u;
}

// The upper arm is a cantilever of 3 E I / L^3 = 10 N/m: of the load's 392 N it carries 2 N itself. Of its own 10 N the tip
// bears 3/8. The rest goes through the contact.
TEST(SelfContact, AnArmHandsToTheOtherWhatLiesOnIt) {
  SoftScene scene;
  const SoftBody& u = add_loaded_u(scene, true);
  double force = 0;  // on the upper arm
  for (const contact::ContactRow& row : scene.islands[0].rows) {
    if (row.sides[0].body != row.sides[1].body) continue;
    const bool upper = u.mesh.X[u.mesh.tets[row.sides[0].tet][0]].y() > 4 * kH;
    force += (upper ? 1 : -1) * row.impulse().y() / scene.dt;
  }
  EXPECT_NEAR(force, 40 * 9.81, 0.05 * 40 * 9.81);
  EXPECT_NEAR(opening(u), 0, 0.01);  // static overlap F dt tau / c_n: 4 mm
}

TEST(SelfContact, WithoutItTheArmGoesThroughTheOther) {
  SoftScene scene;
  EXPECT_LT(opening(add_loaded_u(scene, false)), -0.05);
}

// Arms of a free bar are thrown at each other at 2 m/s each.
TEST(SelfContact, ArmsThatHitEachOtherKeepMomentumAndAngularMomentum) {
  double drift[2];
  for (const bool asks : {false, true}) {
    SoftScene scene;
    scene.dt = 1.0 / 480;
    scene.gravity.setZero();
    scene.solve = {1e-10, 2000};
    SoftBody& u = add_u(scene);
    if (asks) u.meet_itself();
    for (std::size_t k = 0; k < u.mesh.X.size(); ++k) {
      const Vec3& X = u.mesh.X[k];
      u.state.v[k] = Vec3(0.3, 0, 0.1);
      if (X.x() > 2 * kH + 1e-9) u.state.v[k].y() += X.y() > 4 * kH ? -3 : 1;
    }
    const Vec3 p = u.momentum(), L = angular_momentum(u);
    double least = 1;
    int rows = 0;
    for (int k = 0; k < 144; ++k) {
      scene.step();
      least = std::min(least, opening(u));
      rows += static_cast<int>(scene.rows.size());
    }
    EXPECT_NEAR((u.momentum() - p).norm(), 0, 1e-9 * p.norm());
    drift[asks] = (angular_momentum(u) - L).norm() / L.norm();
    EXPECT_EQ(rows > 0, asks);
    if (asks) EXPECT_GT(least, -0.01);
    else EXPECT_LT(least, -0.05);
  }
  EXPECT_LT(drift[1], 0.002);  // the linearised step's own is 0.0006
}

}  // namespace
}  // namespace crumple::sim::islands
