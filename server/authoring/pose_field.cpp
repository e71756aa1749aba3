#include "server/authoring/pose_field.h"

#include <cassert>
#include <cmath>

namespace crumple::authoring {
namespace {

double crushed(const Dent& d, double s) {
  if (s >= d.zone) return 0;
  return d.depth * std::pow(1 - std::max(s, 0.0) / d.zone, 1.5);
}

double flattened(const Dent& d, double s) {
  const double soft = 0.1 * d.depth, over = (d.depth - s) / soft;
  return over > 30 ? d.depth - s : soft * std::log1p(std::exp(over));
}

}  // namespace

PoseField dent(const Dent& d) {
  assert(d.profile == Dent::Profile::flatten || d.zone > 1.5 * d.depth);
  return [d](const Vec3& X) -> Vec3 {
    const double s = d.direction.dot(X) - d.face;
    const Vec3 from_centre = X - d.centre;
    const double bell = std::exp(-from_centre.cwiseQuotient(d.footprint).squaredNorm());
    const double push = bell * (d.profile == Dent::Profile::crush ? crushed(d, s) : flattened(d, s));
    const Vec3 sideways = from_centre - d.direction * d.direction.dot(from_centre);
    const double distance = sideways.norm();
    const Vec3 swelling = distance > 0 ? Vec3(sideways * (d.swell * push / distance)) : Vec3::Zero();
    return d.direction * push + swelling;
  };
}

PoseField kink(const Kink& k) {
  return [k](const Vec3& X) -> Vec3 {
    const Vec3 r = X - k.centre;
    const double along = k.axis.dot(r) / k.width;
    const Vec3 turned = Eigen::AngleAxisd(k.angle / 2 * std::tanh(along), k.hinge) * r;
    // For a positive angle the ends come together on the side of hinge x axis.
    const Vec3 pressed_side = k.hinge.cross(k.axis);
    const double pressed = std::max(0.0, pressed_side.dot(r));
    const double near = std::exp(-along * along);
    const Vec3 give = pressed > 0 ? Vec3(-pressed_side * std::min(k.pinch, pressed) * near) : Vec3::Zero();
    return turned - r + give;
  };
}

PoseField sum(PoseField a, PoseField b) {
  return [a = std::move(a), b = std::move(b)](const Vec3& X) -> Vec3 { return a(X) + b(X); };
}

}  // namespace crumple::authoring
