#include "server/lab/scene_picture.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace crumple::lab {
namespace {

constexpr double kNearest = 0.05;  // [m] in front of the eye
constexpr double kAmbient = 0.35;  // share of light that comes from everywhere

// Of full weight in a channel, linear RGB; the page's, in its order (client/viewer/web/src/channel_colours.js).
constexpr std::array<std::array<double, 3>, 8> kChannelColours{{{0.80, 0.04, 0.02}, {0.03, 0.16, 0.75}, {0.05, 0.50, 0.08}, {0.90, 0.55, 0.02},
                                                                {0.50, 0.03, 0.55}, {0.02, 0.55, 0.60}, {0.90, 0.20, 0.01}, {0.25, 0.10, 0.03}}};
constexpr double kUndented = 0.4;  // grey of an example-based body's rest pose where values are shown

// Linear light as an sRGB byte.
int srgb(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  const double coded = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * coded));
}

struct Projection {
  Vec3 eye, right, up, forward;
  double scale;             // [px] a metre at a metre's distance
  Eigen::Vector2d middle;   // [px]

  Projection(const Camera& camera, int width, int height)
      : eye(camera.eye), middle(0.5 * width, 0.5 * height) {
    forward = (camera.target - eye).normalized();
    right = forward.cross(Vec3::UnitY()).normalized();
    up = right.cross(forward);
    scale = 0.5 * height / std::tan(0.5 * camera.field_of_view);
  }
  double distance(const Vec3& p) const { return forward.dot(p - eye); }
  Eigen::Vector2d operator()(const Vec3& p) const {
    const Vec3 from = p - eye;
    return middle + scale / forward.dot(from) * Eigen::Vector2d(right.dot(from), -up.dot(from));
  }
};

void add_patches(const BodyTopology& body, const BodyFrame& at, const Projection& project, std::vector<Patch>& patches) {
  const Vec3 sun = (project.up - project.right - project.forward).normalized();
  const auto place = [&](int vertex) -> Vec3 {
    return body.deformable ? at.positions[vertex].cast<double>() : at.pose * body.vertices[vertex].cast<double>();
  };
  const std::size_t vertices = at.positions.size(), channels = vertices > 0 ? at.values.size() / vertices : 0;
  const bool shows_examples = channels > 0 && body.model == BodyModel::example_based;
  const Vec3 base = shows_examples ? Vec3(Vec3::Constant(kUndented)) : Vec3(body.colour[0], body.colour[1], body.colour[2]);
  for (const Triangle& triangle : body.triangles) {
    const Vec3 a = place(triangle[0]), b = place(triangle[1]), c = place(triangle[2]);
    if (std::min({project.distance(a), project.distance(b), project.distance(c)}) < kNearest) continue;
    const Vec3 normal = (b - a).cross(c - a).normalized();
    if (!normal.allFinite()) continue;
    Vec3 colour = base;
    for (std::size_t c = 0; c < channels; ++c) {
      double value = 0;
      for (const int corner : triangle) value += at.values[c * vertices + static_cast<std::size_t>(corner)] / 3.0;
      const auto& [red, green, blue] = kChannelColours[c % kChannelColours.size()];
      colour += value * (Vec3(red, green, blue) - base);
    }
    const double lit = kAmbient + (1 - kAmbient) * std::abs(normal.dot(sun));
    const Vec3 light = lit * colour;
    patches.push_back({project.distance((a + b + c) / 3), {project(a), project(b), project(c)},
                       {srgb(light.x()), srgb(light.y()), srgb(light.z())}, body.opacity});
  }
}

}  // namespace

std::vector<Patch> patches(const Topology& topology, const Frame& frame, const Camera& camera, int width, int height) {
  const Projection project(camera, width, height);
  std::vector<Patch> out;
  for (const BodyFrame& at : frame.bodies) add_patches(topology.bodies[at.id], at, project, out);
  std::ranges::stable_sort(out, std::greater(), &Patch::distance);
  return out;
}

std::string svg_tile(const Topology& topology, const Frame& frame, const Camera& camera, int x, int y, int width, int height) {
  std::ostringstream svg;
  svg << std::fixed << std::setprecision(1);
  svg << "<svg x=\"" << x << "\" y=\"" << y << "\" width=\"" << width << "\" height=\"" << height << "\">\n";
  for (const Patch& patch : patches(topology, frame, camera, width, height)) {
    const bool inside = std::ranges::any_of(patch.corners, [&](const Eigen::Vector2d& p) {
      return p.x() > -width && p.x() < 2 * width && p.y() > -height && p.y() < 2 * height;
    });
    if (!inside) continue;
    // The edge in the same colour closes the seams between neighbours.
    const std::string rgb = "rgb(" + std::to_string(patch.rgb[0]) + "," + std::to_string(patch.rgb[1]) + "," + std::to_string(patch.rgb[2]) + ")";
    svg << "<path d=\"M" << patch.corners[0].x() << " " << patch.corners[0].y();
    for (int k = 1; k < 3; ++k) svg << "L" << patch.corners[k].x() << " " << patch.corners[k].y();
    svg << "Z\" fill=\"" << rgb << "\"";
    if (patch.opacity < 1) svg << " fill-opacity=\"" << patch.opacity << "\"";
    else svg << " stroke=\"" << rgb << "\" stroke-width=\"0.6\"";
    svg << "/>\n";
  }
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace crumple::lab
