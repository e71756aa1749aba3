#include "server/scene_convert/generated_shape.h"

namespace crumple::scene_convert {

double number_or(bool given, double value, double missing, const sim::Range& range, const std::string& field,
                 Conversion& c) {
  if (!given) return missing;
  c.breach.number(value, range, field);
  return value;
}

authoring::BarrelShape to_barrel(const v1::BarrelShape& m, const std::string& field, Conversion& c) {
  constexpr sim::Range kSize{0.05, 100};
  authoring::BarrelShape s;
  s.height = number_or(m.has_height(), m.height(), s.height, kSize, field + ".height", c);
  s.radius = number_or(m.has_radius(), m.radius(), s.radius, kSize, field + ".radius", c);
  s.taper = number_or(m.has_taper(), m.taper(), s.taper, {0, 0.9}, field + ".taper", c);
  s.hoops = static_cast<int>(number_or(m.has_hoops(), m.hoops(), s.hoops, {0, 20}, field + ".hoops", c));
  s.hoop_depth =
      number_or(m.has_hoop_depth(), m.hoop_depth(), s.hoop_depth, {0, s.radius / 2}, field + ".hoop_depth", c);
  // the default depth of a small barrel is that of its limit
  s.lid_depth = number_or(m.has_lid_depth(), m.lid_depth(), std::min(s.lid_depth, s.height / 4), {0, s.height / 4},
                          field + ".lid_depth", c);
  return s;
}

authoring::CarShape to_car(const v1::CarShape& m, const std::string& field, Conversion& c) {
  constexpr sim::Range kSize{0.1, 100};
  authoring::CarShape s;
  s.length = number_or(m.has_length(), m.length(), s.length, kSize, field + ".length", c);
  s.width = number_or(m.has_width(), m.width(), s.width, kSize, field + ".width", c);
  s.height = number_or(m.has_height(), m.height(), s.height, kSize, field + ".height", c);
  return s;
}

}  // namespace crumple::scene_convert
