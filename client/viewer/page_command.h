#pragma once

#include "client/viewer/viewed_world.h"

#include <string>
#include <string_view>

namespace crumple::viewer {

// What a page asks for, as JSON:
//   {"type": "credit"}                        the next frame may come
//   {"type": "values", "on": bool}            colours by stress and example weight
//   {"type": "play" | "pause" | "restart"}
//   {"type": "step", "count": n}              1 to 10,000 steps
//   {"type": "push", "body": id, "point": [x, y, z], "impulse": [x, y, z]}   in W [m], [N s]
struct PageRequest {
  enum class Kind { credit, values, play, pause, restart, step, push } kind;
  bool on = false;
  std::uint32_t count = 1;
  BodyId body = 0;
  Vec3 point = Vec3::Zero();
  Vec3 impulse = Vec3::Zero();
};

// Pages are as untrusted as any client: everything else is an error that names the field.
Result<PageRequest> parse_request(std::string_view json);

// Carries out what concerns the world (credit and values do not). Errors: the server's.
Result<void> perform(const PageRequest& request, ViewedWorld& world);

}  // namespace crumple::viewer
