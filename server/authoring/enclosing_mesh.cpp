#include "server/authoring/enclosing_mesh.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/text.h"
#include "server/authoring/lattice_cover.h"
#include "server/authoring/solid_fraction.h"
#include "server/authoring/tet_connectivity.h"

namespace crumple::authoring {
namespace {

struct Solid {
  explicit Solid(const sim::SurfaceMesh& surface) : surface(surface), winding(surface), distance(surface) {}

  const sim::SurfaceMesh& surface;
  WindingNumber winding;
  SurfaceDistance distance;
};

struct CoveredLattice {
  BccLattice lattice;
  std::vector<Cover> cover;
  int tets = 0;
};

double extent(const sim::SurfaceMesh& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : surface.vertices) box.extend(v);
  return box.sizes().maxCoeff();
}

// Nothing where the lattice would be too large to look at.
std::optional<CoveredLattice> cover_with(const Solid& solid, double h) {
  CoveredLattice out{lattice_around(solid.surface, h), {}, 0};
  if (out.lattice.cell_count() > kMaxCells) return std::nullopt;
  out.cover = classify(out.lattice, solid.surface, solid.winding, solid.distance);
  out.tets = static_cast<int>(out.cover.size() - std::count(out.cover.begin(), out.cover.end(), Cover::outside));
  return out;
}

Result<CoveredLattice> cover_at_cell_size(const Solid& solid, double h) {
  auto covered = cover_with(solid, h);
  if (!covered)
    return invalid("cell_size",
                   text("is ", h, " m, which gives more than ", kMaxCells, " lattice cells around the surface"));
  if (covered->tets > sim::kMaxTets)
    return invalid("cell_size",
                   text("is ", h, " m, which gives ", covered->tets, " tets, must give at most ", sim::kMaxTets));
  return std::move(*covered);
}

// The finest lattice tried that stays within the budget. The count goes about with h^-2 (sheets) to h^-3 (solids).
Result<CoveredLattice> cover_within_budget(const Solid& solid, int budget) {
  constexpr int kTries = 10;
  constexpr double kGoodEnough = 0.9;
  const double coarsest = extent(solid.surface);
  auto best = cover_with(solid, coarsest);
  if (!best || best->tets > budget)
    return invalid("tet_budget",
                   text("is ", budget, ", must be at least ", best ? best->tets : 0, " for this surface"));
  double too_fine = 0, h = coarsest * std::pow(static_cast<double>(best->tets) / budget, 1 / 2.5);
  for (int k = 0; k < kTries && best->tets < kGoodEnough * budget; ++k) {
    auto next = cover_with(solid, h);
    const double count = next ? next->tets : 10.0 * budget;
    if (count > budget)
      too_fine = h;
    else if (next->tets >= best->tets)
      best = std::move(next);
    const double guess = h * std::pow(count / (0.96 * budget), 1 / 2.5);
    const bool in_bracket = guess > too_fine && guess < best->lattice.h;
    h = in_bracket ? guess : std::sqrt(std::max(too_fine, 0.1 * best->lattice.h) * best->lattice.h);
  }
  return std::move(*best);
}

Result<void> check(const EnclosingOptions& o) {
  if (!std::isfinite(o.cell_size) || o.cell_size < 0)
    return invalid("cell_size", text("is ", o.cell_size, ", must be finite and not negative"));
  if (o.cell_size == 0 && (o.tet_budget < 1 || o.tet_budget > sim::kMaxTets))
    return invalid("tet_budget", text("is ", o.tet_budget, ", must be in [1, ", sim::kMaxTets, "]"));
  if (!(o.minimum_fill > 0 && o.minimum_fill <= 1))
    return invalid("minimum_fill", text("is ", o.minimum_fill, ", must be in (0, 1]"));
  return {};
}

EnclosingMesh collect(const CoveredLattice& covered, const WindingNumber& solid, double minimum_fill) {
  EnclosingMesh out;
  out.report.cell_size = covered.lattice.h;
  std::vector<int> node_of(covered.lattice.node_slots(), -1);
  for (std::int64_t id = 0; id < covered.lattice.tet_slots(); ++id) {
    if (covered.cover[id] == Cover::outside) continue;
    Tet tet;
    const auto slots = covered.lattice.nodes(id);
    for (int k = 0; k < 4; ++k) {
      int& node = node_of[slots[k]];
      if (node < 0) {
        node = out.mesh.node_count();
        out.mesh.X.push_back(covered.lattice.position(slots[k]));
      }
      tet[k] = node;
    }
    const bool cut = covered.cover[id] == Cover::cut;
    const double fraction = cut ? solid_fraction(solid, covered.lattice.corners(id)) : 1.0;
    out.report.cut_tets += cut;
    out.report.floored_tets += fraction < minimum_fill;
    out.mesh.tets.push_back(tet);
    out.mesh.fill.push_back(std::max(minimum_fill, fraction));
  }
  const auto neighbours = face_neighbours(out.mesh.tets);
  out.report.bodies = face_parts(neighbours).count;
  out.report.pinched_nodes = static_cast<int>(pinched_nodes(out.mesh.tets, neighbours, out.mesh.node_count()).size());
  return out;
}

}  // namespace

Result<EnclosingMesh> enclosing_mesh(const sim::SurfaceMesh& surface, const EnclosingOptions& options) {
  if (auto valid = sim::validate(surface, "surface"); !valid) return std::unexpected(valid.error());
  if (auto valid = check(options); !valid) return std::unexpected(valid.error());
  if (!(extent(surface) > 0)) return invalid("surface", "has no extent: all its vertices are one point");
  if (!std::isfinite(extent(surface))) return invalid("surface", "has an extent that is not finite");

  const Solid solid(surface);
  auto covered = options.cell_size > 0 ? cover_at_cell_size(solid, options.cell_size)
                                       : cover_within_budget(solid, options.tet_budget);
  if (!covered) return std::unexpected(covered.error());
  return collect(*covered, solid.winding, options.minimum_fill);
}

}  // namespace crumple::authoring
