#include "server/scene_convert/generated_shape.h"

#include "server/scene_convert/geometry_convert.h"

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

static authoring::Loft to_loft(const v1::Loft& m, const std::string& field, Conversion& c) {
  constexpr sim::Range kSize{1e-4, 1e4};
  authoring::Loft loft{.axis = static_cast<int>(m.axis()), .stations = {}};
  c.breach.require(loft.axis >= 0 && loft.axis < 3, field + ".axis", "is " + std::to_string(loft.axis) + ", must be X, Y or Z");
  loft.sides = static_cast<int>(number_or(m.has_sides(), m.sides(), loft.sides, {3, 1000}, field + ".sides", c));
  loft.power = number_or(m.has_power(), m.power(), loft.power, {0.5, 100}, field + ".power", c);
  c.breach.count(static_cast<std::size_t>(m.stations_size()), 2, 1000, field + ".stations");
  for (int k = 0; c.breach.ok() && k < m.stations_size(); ++k) {
    const v1::LoftStation& station = m.stations(k);
    const std::string at = entry(field + ".stations", k);
    const Vec3 centre = to_vec3(station.centre());
    c.breach.vector(centre, 1e4, at + ".centre");
    c.breach.number(station.width(), kSize, at + ".width");
    c.breach.number(station.height(), kSize, at + ".height");
    c.breach.require(k == 0 || centre[loft.axis] > loft.stations.back().centre[loft.axis], at + ".centre",
                     "must lie beyond the station before it along the axis");
    loft.stations.push_back({centre, station.width(), station.height()});
  }
  return loft;
}

std::vector<authoring::Loft> to_lofts(const v1::LoftSurface& m, const std::string& field, Conversion& c) {
  std::vector<authoring::Loft> lofts;
  c.breach.count(static_cast<std::size_t>(m.parts_size()), 1, 100, field + ".parts");
  for (int k = 0; c.breach.ok() && k < m.parts_size(); ++k) lofts.push_back(to_loft(m.parts(k), entry(field + ".parts", k), c));
  return lofts;
}

}  // namespace crumple::scene_convert
