// Soft bodies that would pass through each other between two ends of a step of 1/60 s.
#include "tests/sim/world/world_bodies.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim {
namespace {

constexpr double kDt = 1.0 / 60;  // [s]
constexpr double kThin = 0.01;    // [m]

// Cells over a box of a size [m] with its middle at the pose's origin; a round one is pulled in to an ellipse across y.
BodyDescription soft_box(const std::string& name, const Vec3& size, std::array<int, 3> cells, const Pose& pose, bool round = false) {
  BodyDescription body = soft_block(name, cells, 1, pose, Vec3::Zero(), 1e10);  // sound is faster than what is shot
  FemModel& model = std::get<FemModel>(body.model);
  TetMesh mesh = *model.mesh;
  for (Vec3& X : mesh.X) {
    Vec3 s = (2 * X.array() / Vec3(cells[0], cells[1], cells[2]).array() - 1).matrix();  // -1 to 1
    if (round) {
      const double square = std::max(std::abs(s.x()), std::abs(s.z())), radius = std::hypot(s.x(), s.z());
      if (radius > 0) s.x() *= square / radius, s.z() *= square / radius;
    }
    X = 0.5 * size.cwiseProduct(s);
  }
  model.mesh = std::make_shared<TetMesh>(std::move(mesh));
  model.material.cg_tolerance = 1e-6;
  return body;
}

// Of the middle of a body over that part of another that is under it, or else over all of it [m].
double height_over(const World& world, BodyId upper, BodyId lower) {
  const Vec3 middle = world.pose(upper).p_WB;
  const FemView below = world.fem(lower);
  double sum = 0;
  int count = 0;
  for (const Vec3& x : below.x) {
    if (std::max(std::abs(x.x() - middle.x()), std::abs(x.z() - middle.z())) > 0.2) continue;
    sum += x.y();
    ++count;
  }
  return middle.y() - (count > 0 ? sum / count : world.pose(lower).p_WB.y());
}

struct Flight {
  double least = 1e300;    // height of the shot over the panel at the end of any step [m]
  double momentum = 0;     // largest change [of the shot's]
  double energy = 0;       // largest, of kinetic and elastic [of the shot's]
  int inverted = 0;        // tets, at the end
};

Flight shot_at_panel(bool round, bool held, double speed, double phase) {
  const double start = 0.5 * kThin + 0.02 + (0.3 + phase) * speed * kDt;
  const double aside = held ? 0.03 : 0;  // a free panel would turn by radians a step
  BodyDescription shot = soft_box("shot", {0.4, kThin, 0.4}, {4, 1, 4}, at(aside, start, 0.6 * aside), round);
  shot.velocity = Vec3(0, -speed, 0);
  BodyDescription panel = soft_box("panel", held ? Vec3(1, kThin, 1) : Vec3(0.5, kThin, 0.5), {6, 1, 6}, at(0, 0, 0));
  if (held) {
    FemModel& model = std::get<FemModel>(panel.model);
    NodeMotion& all = model.motions.emplace_back();
    for (int n = 0; n < static_cast<int>(model.mesh->X.size()); ++n) all.nodes.push_back(n);
  }
  auto world = make_world(empty_space({shot, panel}));
  const Energies before = world->energies();
  Flight flight;
  for (int k = 0; k < 20; ++k) {
    world->step();
    flight.least = std::min(flight.least, height_over(*world, 0, 1));
    const Energies now = world->energies();
    flight.momentum = std::max(flight.momentum, (now.momentum - before.momentum).norm() / before.momentum.norm());
    flight.energy = std::max(flight.energy, (now.kinetic + now.elastic) / before.kinetic);
  }
  flight.inverted = world->fem(0).inverted + world->fem(1).inverted;
  return flight;
}

TEST(WorldFastContact, APlateAndADiscFaceOnAt1000MetresASecondDoNotPassAThinPanel) {
  for (const bool round : {false, true})
    for (const double speed : {10.0, 100.0, 1000.0})
      for (const double phase : {0.0, 0.13, 0.37, 0.5, 0.71, 0.94}) {
        const Flight flight = shot_at_panel(round, false, speed, phase);
        const std::string shot = std::string(round ? "disc " : "plate ") + std::to_string(speed) + " m/s, " + std::to_string(phase);
        EXPECT_GT(flight.least, 0.5 * kThin) << shot;
        EXPECT_LT(flight.momentum, 1e-5) << shot;  // an order above the tolerance
        EXPECT_LT(flight.energy, 1.01) << shot;
        EXPECT_EQ(flight.inverted, 0) << shot;
      }
}

TEST(WorldFastContact, AHeldPanelStopsThemAsWell) {
  for (const bool round : {false, true})
    for (const double phase : {0.0, 0.3, 0.6, 0.9}) {
      const Flight flight = shot_at_panel(round, true, 1000, phase);
      EXPECT_GT(flight.least, 0.5 * kThin) << round << " " << phase;
      EXPECT_LT(flight.energy, 1 + 1e-6);
    }
}

// Of the mean of those nodes of a body for which `of` holds at rest: how far round y it is [rad].
template <class Of>
double angle_of(const World& world, const BodyDescription& body, BodyId id, Of of) {
  const std::vector<Vec3>& X = std::get<FemModel>(body.model).mesh->X;
  const FemView now = world.fem(id);
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < X.size(); ++n)
    if (of(X[n])) sum += now.x[n];
  return std::atan2(-sum.z(), sum.x());
}

// Two crossed bars 2 cm thick: none of their nodes meets a triangle of the other, edges do. The one turns about its middle, and its
// ends move by 0.1 to 0.3 m a step; the other stands in their way and takes of the motion.
TEST(WorldFastContact, ABarThatSpinsMeetsAThinPost) {
  for (const double rate : {20.0, 40.0, 60.0}) {
    BodyDescription bar = soft_box("bar", {0.6, 0.02, 0.02}, {7, 1, 1}, at(0, 0, 0));
    bar.angular_velocity = Vec3(0, rate, 0);
    const double ahead = 0.5 * rate * kDt;  // the post is met in the middle of the first step
    BodyDescription post =
        soft_box("post", {0.02, 0.6, 0.02}, {1, 7, 1}, at(0.22 * std::cos(ahead), 0.013, -0.22 * std::sin(ahead)));
    for (BodyDescription* body : {&bar, &post})  // stiff ones are stretched by a linearised step that turns so far
      std::get<FemModel>(body->model).material.young = 1e4;
    auto world = make_world(empty_space({bar, post}));
    const Energies before = world->energies();
    for (int k = 0; k < 2; ++k) {
      world->step();
      const double struck = angle_of(*world, bar, 0, [](const Vec3& X) { return std::abs(X.x() - 0.3 * 5 / 7) < 0.01; });
      const double middle = angle_of(*world, post, 1, [](const Vec3& X) { return std::abs(X.y()) < 0.05; });
      EXPECT_LT(struck, middle) << rate << " " << k;
    }
    const Energies after = world->energies();
    EXPECT_GT(world->velocity(1).norm(), 0.05 * 0.22 * rate) << rate;
    EXPECT_LT(after.momentum.norm(), 1e-5 * std::sqrt(2 * before.kinetic * 0.24));  // an order above the tolerance
    EXPECT_LT(after.kinetic, before.kinetic) << rate;
    EXPECT_NEAR(after.angular_momentum.y(), before.angular_momentum.y(), 0.1 * before.angular_momentum.y()) << rate;
  }
}

// The same post, out of the circle that the bar's ends go through.
TEST(WorldFastContact, ABarThatSpinsBesideAPostDoesNotTouchIt) {
  BodyDescription bar = soft_box("bar", {0.6, 0.02, 0.02}, {7, 1, 1}, at(0, 0, 0));
  bar.angular_velocity = Vec3(0, 40, 0);
  auto world = make_world(empty_space({bar, soft_box("post", {0.02, 0.6, 0.02}, {1, 7, 1}, at(0.4, 0.013, -0.1))}));
  for (int k = 0; k < 3; ++k) world->step();
  EXPECT_LT(world->velocity(1).norm(), 1e-20);  // what solves leave of nothing
}

}  // namespace
}  // namespace crumple::sim
