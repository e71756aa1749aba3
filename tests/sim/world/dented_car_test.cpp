// A dented car looks like its examples: what a blow makes of it lies between the poses that were authored for it, and
// the pose on the side of the blow has the largest part in it. Jones et al. 2016, sections 3.1 and 3.2.
#include "tests/sim/world/world_bodies.h"

#include "server/authoring/car_asset.h"
#include "server/sim/example_based/skinning.h"

#include <Eigen/QR>

#include <algorithm>
#include <bit>

namespace crumple::sim {
namespace {

using example_based::ExampleSet;

// From x to the convex hull of the columns of P [m]. Its nearest point is a convex combination of at most four of them
// (Caratheodory), so it is that of least distance among those which affine least squares find inside a choice of four
// or fewer.
double distance_to_hull(const Eigen::Matrix3Xd& P, const Vec3& x) {
  double least = std::numeric_limits<double>::infinity();
  for (unsigned chosen = 1; chosen < 1u << P.cols(); ++chosen) {
    if (std::popcount(chosen) > 4) continue;
    std::vector<int> of;
    for (int e = 0; e < P.cols(); ++e)
      if (chosen >> e & 1) of.push_back(e);
    Eigen::MatrixXd edges(3, of.size() - 1);
    for (std::size_t k = 1; k < of.size(); ++k)
      edges.col(static_cast<Eigen::Index>(k) - 1) = P.col(of[k]) - P.col(of[0]);
    const Vec3 from_first = x - P.col(of[0]);
    Eigen::VectorXd share = Eigen::VectorXd::Zero(edges.cols());
    if (of.size() > 1) share = edges.completeOrthogonalDecomposition().solve(from_first);
    if ((share.array() < -1e-9).any() || share.sum() > 1 + 1e-9) continue;
    least = std::min(least, (from_first - edges * share).norm());
  }
  return least;
}

TEST(DentedCar, DistanceToAHullIsThatOfItsNearestFaceEdgeOrCorner) {
  Eigen::Matrix3Xd P(3, 5);
  P << 0, 1, 0, 0, 0.2, 0, 0, 1, 0, 0.2, 0, 0, 0, 1, 0.2;
  EXPECT_NEAR(distance_to_hull(P, {0.25, 0.25, 0.25}), 0, 1e-15);
  EXPECT_NEAR(distance_to_hull(P, {0.2, 0.2, -3}), 3, 1e-12);
  EXPECT_NEAR(distance_to_hull(P, {0.5, -3, -4}), 5, 1e-12);
  EXPECT_NEAR(distance_to_hull(P, {-1, -2, -2}), 3, 1e-12);
  EXPECT_NEAR(distance_to_hull(P, {1, 1, 1}), 2 / std::sqrt(3), 1e-12);
}

struct Blow {
  const char* name;
  Vec3 towards;         // of the ball, a unit vector
  Vec3 at;              // what it aims at, in the car's axes [m]
  const char* example;  // of that side
};

struct StruckCar : testing::TestWithParam<Blow> {};

TEST_P(StruckCar, LiesBetweenItsExamplesAndLooksLikeThatOfTheBlowsSide) {
  const Blow& blow = GetParam();
  auto made = authoring::make_car_asset();
  ASSERT_TRUE(made);
  made->render = {};  // what is drawn is the tets' surface then, whose vertices have weights of their own
  const auto set = std::make_shared<const ExampleSet>(*std::move(made));
  ExampleModel model{.set = set, .mass = 1200};
  model.parameters = {.alpha = 100, .beta = 100, .gamma = 2, .lambda = 0.9};
  BodyDescription car{.name = "car"};
  car.model = model;
  SceneDescription scene =
      empty_space({car, ball("ball", 0.25, 250, {Quat::Identity(), blow.at - 4 * blow.towards}, 25 * blow.towards)});
  scene.dt = 0.004;
  const auto world = make_world(scene);
  for (int k = 0; k < 200; ++k) world->step();

  // The example that has the largest part, over all vertices.
  Eigen::RowVectorXd part = world->example_weights(0).colwise().mean();
  part(0) = 0;
  Eigen::Index largest = 0;
  EXPECT_GT(part.maxCoeff(&largest), 0.05) << "the car must be dented for this to say anything";
  EXPECT_EQ(set->examples[static_cast<std::size_t>(largest)].name, blow.example) << part;

  const example_based::ExampleRest rest = example_based::make_rest(set);
  const Frame frame = world->capture();
  ASSERT_EQ(frame.bodies[0].positions.size(), rest.surface_vertices.size());
  double farthest = 0, moved = 0, beside = 0;
  for (std::size_t v = 0; v < rest.surface_vertices.size(); v += 4) {
    const Pose X_WB = world->pose(0);
    const Vec3 x = X_WB.R_WB.conjugate() * (frame.bodies[0].positions[v].cast<double>() - X_WB.p_WB);
    const int i = rest.surface_vertices[v];
    Eigen::Matrix3Xd P(3, set->example_count());
    for (int e = 0; e < set->example_count(); ++e) P.col(e) = example_based::skin_in_example(rest, i, e);
    farthest = std::max(farthest, distance_to_hull(P, x));
    moved = std::max(moved, (x - P.col(0)).norm());
    beside = std::max(beside,
                      distance_to_hull(P, x + 0.02 * P.col(0).normalized()));  // what swells by 2 cm is no such shape
  }
  EXPECT_LT(farthest, 1e-5);  // [m]; a frame's floats, 30 m away, are good to 2e-6
  EXPECT_GT(moved, 0.1);
  EXPECT_GT(beside, 0.019);
}

INSTANTIATE_TEST_SUITE_P(DentedCar, StruckCar,
                         testing::Values(Blow{"Front", {-1, 0, 0}, {2.1, 0.55, 0}, "crushed_front"},
                                         Blow{"Rear", {1, 0, 0}, {-2.1, 0.6, 0}, "crushed_rear"},
                                         Blow{"Left", {0, 0, 1}, {0, 0.6, -0.85}, "dented_left"},
                                         Blow{"Right", {0, 0, -1}, {0, 0.6, 0.85}, "dented_right"},
                                         Blow{"Roof", {0, -1, 0}, {-0.3, 1.4, 0}, "roof_flattened"}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace crumple::sim
