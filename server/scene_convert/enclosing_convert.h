#pragma once

#include "server/authoring/enclosing_mesh.h"
#include "server/scene_convert/generated_shape.h"
#include "server/sim/mesh/tet_mesh.h"

namespace crumple::scene_convert {

inline constexpr sim::Range kCellSize{1e-4, 1e4};  // of enclosing lattices [m]

// cell_size or tet_budget, and minimum_fill, of EnclosingTets and of DefaultAsset.
template <class Message>
authoring::EnclosingOptions to_enclosing(const Message& message, const std::string& field, Conversion& c) {
  authoring::EnclosingOptions options;
  options.cell_size =
      number_or(message.has_cell_size(), message.cell_size(), options.cell_size, kCellSize, field + ".cell_size", c);
  options.tet_budget = static_cast<int>(number_or(message.has_tet_budget(), message.tet_budget(), options.tet_budget,
                                                  {1, sim::kMaxTets}, field + ".tet_budget", c));
  options.minimum_fill = number_or(message.has_minimum_fill(), message.minimum_fill(), options.minimum_fill,
                                   {0, 1, true}, field + ".minimum_fill", c);
  return options;
}

}  // namespace crumple::scene_convert
