#include "server/sim/fem/material_region.h"

#include "common/text.h"

namespace crumple::sim::fem {

namespace {

Result<void> validate_whole_body(const FemMaterial& own, const FemMaterial& body, const std::string& field) {
  const auto same = [&](const char* name, double value, double of_body) -> Result<void> {
    if (value == of_body) return {};
    return invalid(text(field, ".", name), text("is ", value, ", must be that of the body's material (", of_body, ")"));
  };
  for (const Result<void>& result :
       {same("raw_toughness", own.raw_toughness, body.raw_toughness),
        same("fracture_interval", own.fracture_interval, body.fracture_interval),
        same("fracture_order", static_cast<int>(own.fracture_order), static_cast<int>(body.fracture_order)),
        same("max_splits_per_step", own.max_splits_per_step, body.max_splits_per_step),
        same("friction", own.friction, body.friction), same("cg_tolerance", own.cg_tolerance, body.cg_tolerance),
        same("cg_max_iterations", own.cg_max_iterations, body.cg_max_iterations)})
    if (!result) return result;
  return {};
}

}  // namespace

void copy_whole_body_fields(const FemMaterial& from, FemMaterial& to) {
  to.raw_toughness = from.raw_toughness;
  to.fracture_interval = from.fracture_interval;
  to.fracture_order = from.fracture_order;
  to.max_splits_per_step = from.max_splits_per_step;
  to.friction = from.friction;
  to.cg_tolerance = from.cg_tolerance;
  to.cg_max_iterations = from.cg_max_iterations;
}

Result<void> validate(std::span<const MaterialRegion> regions, const FemMaterial& body, int tet_count,
                      const std::string& field) {
  if (regions.size() > kMaxRegions)
    return invalid(field, text("has ", regions.size(), " entries, must have at most ", kMaxRegions));
  std::vector<char> taken(regions.empty() ? 0 : tet_count, 0);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const std::string region = text(field, "[", r, "]");
    if (regions[r].tets.empty()) return invalid(region + ".tets", "is empty, must select one tet at least");
    for (const int t : regions[r].tets) {
      if (t < 0 || t >= tet_count)
        return invalid(region + ".tets", text("names tet ", t, ", must be below the mesh's ", tet_count, " tets"));
      if (taken[t]++) return invalid(region + ".tets", text("names tet ", t, " again, must name a tet once"));
    }
    if (auto ok = validate_whole_body(regions[r].material, body, region + ".material"); !ok) return ok;
  }
  return {};
}

}  // namespace crumple::sim::fem
