#pragma once

#include "common/frame.h"

#include <array>
#include <string>
#include <vector>

// Pictures of a world without a browser.
namespace crumple::lab {

// A pinhole camera above a z-up picture plane.
struct Camera {
  Vec3 eye = Vec3(0, 2, 4);      // in W [m]
  Vec3 target = Vec3::Zero();    // in the middle of the picture [m]
  double field_of_view = 0.6;    // of its height [rad]
};

// A triangle as it is seen: lit, in pixels of its tile from the upper left corner.
struct Patch {
  double distance;                         // of its middle, along the view [m]
  std::array<Eigen::Vector2d, 3> corners;  // [px]
  std::array<int, 3> rgb;                  // sRGB, 0 to 255
  double opacity;
};

// What a tile of `width` x `height` pixels shows, from far to near; what reaches behind the camera is left out.
std::vector<Patch> patches(const Topology& topology, const Frame& frame, const Camera& camera, int width, int height);

// A tile of an SVG: <g> of `width` x `height` pixels whose upper left corner is at (x, y). Triangles are drawn from far to
// near, by their middles, lit from the camera's upper left; vertices that have values in the frame take the colours of
// their channels by them (the first is red), over grey if the body is example-based. What reaches behind the camera is left out.
std::string svg_tile(const Topology& topology, const Frame& frame, const Camera& camera, int x, int y, int width, int height);

}  // namespace crumple::lab
