#include "server/authoring/prescored_parts.h"

#include "common/text.h"
#include "server/authoring/join_parts.h"
#include "server/authoring/part_faces.h"
#include "server/authoring/part_surfaces.h"
#include "server/authoring/restricted_rig.h"
#include "server/authoring/tet_connectivity.h"

#include <cmath>
#include <optional>

namespace crumple::authoring {
namespace {

using sim::TetMesh;
using sim::example_based::ExampleSet;

// Part `index` of a cell, without what is drawn; nothing where its tets are all rounding.
std::optional<PrescoredPart> part_of_cell(const ExampleSet& asset, int cell, const CellParts& own, int index) {
  PrescoredPart part{.cell = cell};
  ExampleSet& set = part.set;
  std::vector<int> id(own.cut.points.size(), -1);
  std::vector<PlaceInTet> places;
  for (std::size_t t = 0; t < own.cut.tets.size(); ++t) {
    if (own.part[own.cut.piece[t]] != index) continue;
    const int source = own.cut.pieces[own.cut.piece[t]].tet;
    Tet tet = own.cut.tets[t];
    for (int& p : tet) {
      if (id[p] < 0) {
        id[p] = static_cast<int>(places.size());
        places.push_back(place_in_tet(asset.mesh, source, own.cut.points[p]));
        set.mesh.X.push_back(own.cut.points[p]);
      }
      p = id[p];
    }
    set.mesh.tets.push_back(tet);
    if (!asset.mesh.fill.empty()) set.mesh.fill.push_back(asset.mesh.fill[source]);
    if (!asset.mesh.tags.empty()) set.mesh.tags.push_back(asset.mesh.tags[source]);
    part.volume += sim::signed_volume(set.mesh, set.mesh.tet_count() - 1);
  }
  if (set.mesh.tets.empty()) return std::nullopt;
  part.bones = restrict_rig(asset, places, set);
  restrict_hulls(asset, places, set);
  return part;
}

PrescoredAsset cut(const ExampleSet& asset, const std::vector<SplinterCell>& cells) {
  const auto neighbours = face_neighbours(asset.mesh.tets);
  const sim::TetTree tree(asset.mesh);
  std::optional<PartSurfaces> surfaces;
  if (!asset.render.triangles.empty()) surfaces.emplace(asset.render);

  PrescoredAsset out;
  std::vector<CellParts> by_cell;
  std::vector<std::vector<int>> part_of(cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const CellParts& own = by_cell.emplace_back(cell_parts(asset.mesh, tree, neighbours, cells[c]));
    std::vector<PrescoredPart> fresh;
    std::vector<int> kept(own.parts, -1);  // which of `fresh` each became
    for (int p = 0; p < own.parts; ++p) {
      std::optional<PrescoredPart> part = part_of_cell(asset, static_cast<int>(c), own, p);
      part_of[c].push_back(part ? static_cast<int>(out.parts.size() + fresh.size()) : -1);
      if (!part) continue;
      kept[p] = static_cast<int>(fresh.size());
      fresh.push_back(std::move(*part));
    }
    if (surfaces && !fresh.empty()) {
      std::vector<const TetMesh*> meshes;
      for (const PrescoredPart& part : fresh) meshes.push_back(&part.set.mesh);
      auto drawn = surfaces->cut(cells[c], own, kept, meshes);
      for (std::size_t p = 0; p < fresh.size(); ++p) fresh[p].set.render = std::move(drawn[p]);
    }
    for (PrescoredPart& part : fresh) out.parts.push_back(std::move(part));
  }
  out.faces = part_faces(neighbours, cells, by_cell, part_of);
  return out;
}

Result<void> check(const std::vector<SplinterCell>& cells) {
  if (cells.empty()) return invalid("cells", "is empty, must hold at least one cell");
  const int count = static_cast<int>(cells.size());
  for (int c = 0; c < count; ++c)
    for (const SplinterCell::Wall& wall : cells[c].walls)
      for (const int other : wall.neighbours)
        if (other < 0 || other >= count || other == c)
          return invalid(text("cells[", c, "].walls"),
                         text("name neighbour ", other, ", must name another of ", count));
  return {};
}

double total_volume(const TetMesh& mesh) {
  double sum = 0;
  for (int t = 0; t < mesh.tet_count(); ++t) sum += sim::signed_volume(mesh, t);
  return sum;
}

}  // namespace

Result<PrescoredAsset> prescored_parts(const ExampleSet& asset, const std::vector<SplinterCell>& cells,
                                       const PrescoringOptions& options) {
  if (!(options.least_part >= 0 && options.least_part < 1))
    return invalid("least_part", text("is ", options.least_part, ", must be in [0, 1)"));
  if (auto ok = sim::example_based::validate(asset, "asset"); !ok) return std::unexpected(ok.error());
  if (auto ok = check(cells); !ok) return std::unexpected(ok.error());
  PrescoredAsset out = cut(asset, cells);
  double volume = 0;
  for (const PrescoredPart& part : out.parts) volume += part.volume;
  const double whole = total_volume(asset.mesh);
  if (std::abs(volume - whole) > 1e-6 * whole)
    return invalid("cells", text("hold ", volume / whole, " of the asset's volume, must hold all of it, once"));
  out = with_small_parts_joined(std::move(out), options.least_part * volume / static_cast<double>(out.parts.size()));
  for (std::size_t p = 0; p < out.parts.size(); ++p)
    if (auto ok = sim::example_based::validate(out.parts[p].set, text("parts[", p, "]")); !ok)
      return std::unexpected(ok.error());
  return out;
}

}  // namespace crumple::authoring
