#include "server/authoring/shapes/car.h"

#include "server/authoring/shapes/car_body.h"
#include "server/authoring/shapes/surfaces.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace crumple::authoring {
namespace {

// A bar across the car that bends back at its ends. `x` is its middle's face, `forward` +1 or -1.
sim::SurfaceMesh bumper(double x, double y, double half_width, double forward) {
  constexpr int kSections = 24, kAround = 12;
  constexpr double kDepth = .07, kHeight = .11;
  sim::SurfaceMesh out;
  for (int i = 0; i <= kSections; ++i) {
    const double s = -1 + 2.0 * i / kSections;
    const Vec3 centre(x - forward * (kDepth + .22 * s * s * s * s), y, half_width * s);
    for (int k = 0; k < kAround; ++k) {
      const double a = 2 * std::numbers::pi * k / kAround;
      // A rounded rectangle: the fourth-power ellipse.
      const double c = std::cos(a), d = std::sin(a), r = std::pow(c * c * c * c + d * d * d * d, -.25);
      out.vertices.push_back(centre + Vec3(kDepth * r * c, kHeight * r * d, 0));
    }
  }
  const auto at = [&](int i, int k) { return i * kAround + k % kAround; };
  for (int i = 0; i < kSections; ++i)
    for (int k = 0; k < kAround; ++k) {
      out.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
      out.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
    }
  for (int k = 1; k + 1 < kAround; ++k) {
    out.triangles.push_back({at(0, 0), at(0, k + 1), at(0, k)});
    out.triangles.push_back({at(kSections, 0), at(kSections, k), at(kSections, k + 1)});
  }
  return out;
}

// Tyre and rim, turned about y, then laid with its axis along z; `outside` +1: the rim faces +z.
sim::SurfaceMesh wheel(double outside) {
  const double r = car::kWheelRadius, w = car::kWheelWidth / 2;
  const Eigen::Vector2d profile[] = {
      {0, -w + .02}, {.55 * r, -w + .02}, {.62 * r, -w}, {.92 * r, -w},      {r, -w + .03},       {r, 0},
      {r, w - .03},  {.92 * r, w},        {.70 * r, w},  {.66 * r, w - .05}, {.30 * r, w - .045}, {.22 * r, w - .01},
      {0, w - .005}};
  sim::SurfaceMesh out;
  const Quat about_x(Eigen::AngleAxisd(outside * std::numbers::pi / 2, Vec3::UnitX()));
  append(out, lathe(profile, 32), {about_x, Vec3::Zero()});
  return out;
}

sim::SurfaceMesh lamp(const Vec3& centre, const Vec3& radii) {
  sim::SurfaceMesh out = icosphere(1, 2);
  for (Vec3& v : out.vertices) v = centre + v.cwiseProduct(radii);
  return out;
}

void scale(sim::SurfaceMesh& surface, const Vec3& by) {
  for (Vec3& v : surface.vertices) v = v.cwiseProduct(by);
}

}  // namespace

sim::SurfaceMesh CarSurface::whole() const {
  sim::SurfaceMesh out = body;
  for (const sim::SurfaceMesh& w : wheels) append(out, w);
  return out;
}

CarSurface car_surface(const CarShape& shape) {
  assert(shape.length > 0 && shape.width > 0 && shape.height > 0);
  const Vec3 by(shape.length / 4.2, shape.height / 1.4, shape.width / 1.7);
  CarSurface out{.body = car::body_shell(),
                 .wheels = {},
                 .wheel_centres = {},
                 .wheel_radius = car::kWheelRadius * by.y(),
                 .wheel_width = car::kWheelWidth * by.z(),
                 .belt_height = .88 * by.y()};
  append(out.body, bumper(2.1, .42, .80, 1));
  append(out.body, bumper(-2.1, .46, .78, -1));
  for (const double side : {-1.0, 1.0}) {
    append(out.body, lamp({1.97, .635, side * .56}, {.10, .055, .13}));
    append(out.body, lamp({-2.0, .75, side * .60}, {.10, .075, .11}));
  }
  scale(out.body, by);
  for (int k = 0; k < 4; ++k) {
    const double side = k % 2 == 0 ? -1 : 1;
    const Vec3 centre(k < 2 ? car::kFrontAxle : car::kRearAxle, car::kWheelRadius,
                      side * (.845 - car::kWheelWidth / 2));
    append(out.wheels[k], wheel(side), {Quat::Identity(), centre});
    scale(out.wheels[k], by);
    out.wheel_centres[k] = centre.cwiseProduct(by);
  }
  return out;
}

}  // namespace crumple::authoring
