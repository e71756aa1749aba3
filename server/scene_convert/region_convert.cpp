#include "server/scene_convert/region_convert.h"

#include "server/scene_convert/fem_convert.h"
#include "server/scene_convert/geometry_convert.h"

#include <algorithm>

namespace crumple::scene_convert {
namespace {

constexpr double kFar = 1e7;  // [m], ten times what a node can reach

Vec3 centroid(const sim::TetMesh& mesh, int t) {
  const Tet& tet = mesh.tets[static_cast<std::size_t>(t)];
  return 0.25 * (mesh.X[tet[0]] + mesh.X[tet[1]] + mesh.X[tet[2]] + mesh.X[tet[3]]);
}

// Marks the tets for whose number `holds` does.
template <class Predicate>
void mark_where(const sim::TetMesh& mesh, std::vector<char>& selected, Predicate holds) {
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (holds(t)) selected[static_cast<std::size_t>(t)] = 1;
}

void mark_box(const v1::BoxRegion& box, const sim::TetMesh& mesh, std::vector<char>& selected, const std::string& field,
              Conversion& c) {
  const Vec3 low = to_vec3(box.min()), high = to_vec3(box.max());
  c.breach.vector(low, kFar, field + ".min");
  c.breach.vector(high, kFar, field + ".max");
  c.breach.require((low.array() <= high.array()).all(), field, "is turned inside out, must have no min above its max");
  mark_where(mesh, selected, [&](int t) {
    const Vec3 p = centroid(mesh, t);
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  });
}

void mark_sphere(const v1::SphereRegion& sphere, const sim::TetMesh& mesh, std::vector<char>& selected,
                 const std::string& field, Conversion& c) {
  const Vec3 centre = to_vec3(sphere.centre());
  const double radius = sphere.has_radius() ? sphere.radius() : 0.5;
  c.breach.vector(centre, kFar, field + ".centre");
  c.breach.number(radius, {0, kFar}, field + ".radius");
  mark_where(mesh, selected, [&](int t) { return (centroid(mesh, t) - centre).norm() <= radius; });
}

void mark_plane(const v1::Plane& plane, const sim::TetMesh& mesh, std::vector<char>& selected, const std::string& field,
                Conversion& c) {
  const Vec3 normal = to_vec3(plane.has_normal(), plane.normal(), sim::Plane().normal);
  c.breach.vector(normal, 2, field + ".normal");
  c.breach.require(std::abs(normal.norm() - 1) <= 1e-6, field + ".normal",
                   "has length " + sim::number_text(normal.norm()) + ", must have unit length");
  c.breach.number(plane.offset(), {-kFar, kFar}, field + ".offset");
  mark_where(mesh, selected, [&](int t) { return normal.dot(centroid(mesh, t)) < plane.offset(); });
}

void mark_ids(const v1::TetIds& ids, std::vector<char>& selected, const std::string& field, Conversion& c) {
  const int count = static_cast<int>(selected.size());
  for (int i = 0; c.breach.ok() && i < ids.ids_size(); ++i) {
    if (ids.ids(i) < 0 || ids.ids(i) >= count)
      c.breach.require(false, entry(field + ".ids", i),
                       "is " + std::to_string(ids.ids(i)) + ", must be a tet of the mesh, below " + std::to_string(count));
    else
      selected[static_cast<std::size_t>(ids.ids(i))] = 1;
  }
}

void mark_tag(int tag, const sim::TetMesh& mesh, std::vector<char>& selected, const std::string& field, Conversion& c) {
  c.breach.require(!mesh.tags.empty(), field,
                   "is " + std::to_string(tag) + ", but the mesh has no tags, must choose by another rule");
  if (c.breach.ok())
    mark_where(mesh, selected, [&](int t) { return mesh.tags[static_cast<std::size_t>(t)] == tag; });
}

void mark(const v1::TetSelection& selection, const sim::TetMesh& mesh, std::vector<char>& selected,
          const std::string& field, Conversion& c) {
  switch (selection.by_case()) {
    case v1::TetSelection::kBox:
      return mark_box(selection.box(), mesh, selected, field + ".box", c);
    case v1::TetSelection::kSphere:
      return mark_sphere(selection.sphere(), mesh, selected, field + ".sphere", c);
    case v1::TetSelection::kPlane:
      return mark_plane(selection.plane(), mesh, selected, field + ".plane", c);
    case v1::TetSelection::kIds:
      return mark_ids(selection.ids(), selected, field + ".ids", c);
    case v1::TetSelection::kTag:
      return mark_tag(selection.tag(), mesh, selected, field + ".tag", c);
    case v1::TetSelection::BY_NOT_SET:
      c.breach.require(false, field, "is empty, must be one of box, sphere, plane, ids, tag");
  }
}

// Hands the tets that any of the selections picks to `region`.
void take_tets(const google::protobuf::RepeatedPtrField<v1::TetSelection>& messages, const sim::TetMesh& mesh, int region,
               std::vector<int>& region_of, const std::string& field, Conversion& c) {
  std::vector<char> selected(mesh.tets.size(), 0);
  for (int i = 0; c.breach.ok() && i < messages.size(); ++i) mark(messages[i], mesh, selected, entry(field, i), c);
  c.breach.require(std::ranges::find(selected, 1) != selected.end(), field,
                   "selects no tet of the mesh, must select one at least");
  for (std::size_t t = 0; t < selected.size(); ++t)
    if (selected[t]) region_of[t] = region;
}

void refuse_whole_body_fields(const v1::FemMaterial& message, const std::string& field, Conversion& c) {
  const auto refuse = [&](bool given, const char* name) {
    c.breach.require(!given, field + "." + name, "goes for the whole body, must be given in the body's own material");
  };
  refuse(message.has_friction(), "friction");
  refuse(message.has_cg_tolerance(), "cg_tolerance");
  refuse(message.has_cg_max_iterations(), "cg_max_iterations");
  refuse(message.has_raw_toughness(), "raw_toughness");
  refuse(message.has_fracture_interval(), "fracture_interval");
  refuse(message.fracture_order() != v1::FemMaterial::RANDOM, "fracture_order");
  refuse(message.has_max_splits_per_step(), "max_splits_per_step");
}

}  // namespace

std::vector<sim::fem::MaterialRegion> to_regions(const google::protobuf::RepeatedPtrField<v1::MaterialRegion>& messages,
                                                 const sim::fem::FemMaterial& body, const sim::TetMesh& mesh,
                                                 const std::string& field, Conversion& c) {
  std::vector<sim::fem::MaterialRegion> regions;
  if (messages.empty()) return regions;
  c.breach.count(static_cast<std::size_t>(messages.size()), 0, sim::fem::kMaxRegions, field);
  std::vector<int> region_of(mesh.tets.size(), -1);
  for (int i = 0; c.breach.ok() && i < messages.size(); ++i) {
    const std::string path = entry(field, i);
    refuse_whole_body_fields(messages[i].material(), path + ".material", c);
    take_tets(messages[i].tets(), mesh, i, region_of, path + ".tets", c);
    regions.push_back({{}, to_material(messages[i].material(), path + ".material", c)});
    copy_whole_body_fields(body, regions.back().material);
  }
  if (!c.breach.ok()) return {};
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (const int r = region_of[static_cast<std::size_t>(t)]; r >= 0)
      regions[static_cast<std::size_t>(r)].tets.push_back(t);
  for (int i = 0; i < messages.size(); ++i)
    c.breach.require(!regions[static_cast<std::size_t>(i)].tets.empty(), entry(field, i) + ".tets",
                     "selects no tet that no later region selects, must keep one at least");
  return regions;
}

}  // namespace crumple::scene_convert
