#include "server/rig/shell_crush.h"

#include "server/authoring/splinter_cut.h"
#include "server/authoring/surface_distance.h"
#include "server/authoring/surface_transfer.h"
#include "server/rig/press_frame.h"
#include "server/rig/thin_shell.h"

#include <algorithm>
#include <cmath>

namespace crumple::rig {
namespace {

constexpr double kDamping = 2, kStill = 30;  // while it is pressed, and when the plate has gone [1/s]
constexpr int kStepsPerSecond = 240, kSubsteps = 20;

// Points carried by the nearest triangles of a surface: where they are on it, and how far off along its normal.
class Carried {
 public:
  Carried(const sim::SurfaceMesh& surface, const std::vector<Vec3>& points) : surface_(surface) {
    const authoring::SurfaceDistance distance(surface);
    for (const Vec3& p : points) {
      const auto nearest = distance.nearest(p);
      const auto corners = corners_of(surface.vertices, nearest.triangle);
      triangle_.push_back(nearest.triangle);
      share_.push_back(authoring::barycentric(nearest.point, corners));
      off_.push_back(normal_of(corners).dot(p - nearest.point));
    }
  }

  std::vector<Vec3> at(const std::vector<Vec3>& x) const {
    std::vector<Vec3> out;
    for (std::size_t p = 0; p < triangle_.size(); ++p) {
      const auto c = corners_of(x, triangle_[p]);
      out.push_back(share_[p][0] * c[0] + share_[p][1] * c[1] + share_[p][2] * c[2] + off_[p] * normal_of(c));
    }
    return out;
  }

 private:
  using Corners = std::array<Vec3, 3>;

  Corners corners_of(const std::vector<Vec3>& x, int triangle) const {
    const Triangle& t = surface_.triangles[triangle];
    return {x[t[0]], x[t[1]], x[t[2]]};
  }
  static Vec3 normal_of(const Corners& c) { return (c[1] - c[0]).cross(c[2] - c[0]).normalized(); }

  const sim::SurfaceMesh& surface_;
  std::vector<int> triangle_;
  std::vector<Vec3> share_;
  std::vector<double> off_;  // [m]
};

// The height of the upper plate.
double plate_at(double time, double extent, double size, double depth) {
  const double down = (1 - depth) * extent;
  if (time < kPress) return extent + (down - extent) * time / kPress;
  return down + (extent + 0.2 * size - down) * std::min((time - kPress) / kRelease, 1.0);
}

}  // namespace

Result<Crushed> shell_crush(const sim::example_based::ExampleSet& set, const std::string& name, const CrushOptions& o,
                            const std::function<void(double)>& progress) {
  const auto tets = tets_to_press(set, o);
  if (!tets) return std::unexpected(tets.error());
  const sim::SurfaceMesh skin = authoring::surface_of(*tets);
  const PressFrame frame(skin.vertices, o.axis, o.from_max);
  sim::SurfaceMesh turned = skin;
  for (Vec3& p : turned.vertices) p = frame.in_press(p);

  ThinShell shell(turned, {.wave_speed = kWaveSpeed * frame.size, .yield_strain = o.yield_strain});
  const int steps = static_cast<int>(std::lround((kPress + kRelease + kRest) * kStepsPerSecond));
  constexpr double h = 1.0 / (kStepsPerSecond * kSubsteps);
  for (int k = 0; k < steps; ++k) {
    const double damping = k < (kPress + kRelease) * kStepsPerSecond ? kDamping : kStill;
    for (int s = 0; s < kSubsteps; ++s) {
      const double top = plate_at((k * kSubsteps + s + 1) * h, frame.extent, frame.size, o.depth);
      shell.substep(h, Vec3::Zero(), damping, [&](const Vec3& before, Vec3& x) {
        if (x.y() >= 0 && x.y() <= top) return;
        x = Vec3(before.x(), std::clamp(x.y(), 0.0, top), before.z());  // what a plate touches does not slide
      });
    }
    shell.flow();
    if (progress) progress((k + 1.0) / steps);
  }

  Crushed out{.copy = {name, {}}, .report = {.plastic_strain = shell.largest_fold(), .steps = steps}};
  const auto released = frame.released(shell.x(), skin.vertices);
  if (!released) return std::unexpected(released.error());
  out.report.thickness = released->thickness;
  out.copy.vertices = Carried(skin, set.render.vertices).at(released->x);
  return out;
}

}  // namespace crumple::rig
