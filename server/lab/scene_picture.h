#pragma once

#include "common/frame.h"

#include <string>

// Pictures of a world without a browser.
namespace crumple::lab {

// A pinhole camera above a z-up picture plane.
struct Camera {
  Vec3 eye = Vec3(0, 2, 4);      // in W [m]
  Vec3 target = Vec3::Zero();    // in the middle of the picture [m]
  double field_of_view = 0.6;    // of its height [rad]
};

// A tile of an SVG: <g> of `width` x `height` pixels whose upper left corner is at (x, y). Triangles are drawn from far to
// near, by their middles, lit from the camera's upper left; vertices that have a value in the frame turn red by it. What
// reaches behind the camera is left out.
std::string svg_tile(const Topology& topology, const Frame& frame, const Camera& camera, int x, int y, int width, int height);

}  // namespace crumple::lab
