#include "server/scene_convert/motion_convert.h"

#include "server/scene_convert/geometry_convert.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <string_view>

namespace crumple::scene_convert {
namespace {

using NodeBox = Eigen::AlignedBox3d;

constexpr double kDefaultTolerance = 1e-6;  // of the bounding box's diagonal
constexpr std::array<std::string_view, 6> kFaces = {"x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};

NodeBox bounding_box(const std::vector<Vec3>& X) {
  NodeBox box;
  for (const Vec3& p : X) box.extend(p);
  return box;
}

// The slab of the bounding box that a face's name means.
NodeBox face_slab(const NodeBox& bounds, std::size_t face) {
  NodeBox slab = bounds;
  const auto axis = static_cast<Eigen::Index>(face / 2);
  if (face % 2 == 0)
    slab.max()[axis] = bounds.min()[axis];
  else
    slab.min()[axis] = bounds.max()[axis];
  return slab;
}

void mark_inside(NodeBox box, double tolerance, const std::vector<Vec3>& X, std::vector<char>& selected) {
  box.min().array() -= tolerance;
  box.max().array() += tolerance;
  for (std::size_t i = 0; i < X.size(); ++i)
    if (box.contains(X[i])) selected[i] = 1;
}

void mark_box(const v1::BoxRegion& region, double tolerance, const std::vector<Vec3>& X, std::vector<char>& selected,
              const std::string& field, Conversion& c) {
  const Vec3 low = to_vec3(region.min()), high = to_vec3(region.max());
  c.breach.vector(low, 1e7, field + ".min");  // ten times what a node can reach
  c.breach.vector(high, 1e7, field + ".max");
  c.breach.require((low.array() <= high.array()).all(), field, "is turned inside out, must have no min above its max");
  if (c.breach.ok()) mark_inside(NodeBox(low, high), tolerance, X, selected);
}

void mark_face(const std::string& name, double tolerance, const NodeBox& bounds, const std::vector<Vec3>& X,
               std::vector<char>& selected, const std::string& field, Conversion& c) {
  const auto face = std::ranges::find(kFaces, name);
  c.breach.require(face != kFaces.end(), field,
                   "is \"" + name + "\", must be one of x_min, x_max, y_min, y_max, z_min, z_max");
  if (c.breach.ok())
    mark_inside(face_slab(bounds, static_cast<std::size_t>(face - kFaces.begin())), tolerance, X, selected);
}

void mark_ids(const v1::NodeIds& ids, std::vector<char>& selected, const std::string& field, Conversion& c) {
  const int n = static_cast<int>(selected.size());
  for (int i = 0; c.breach.ok() && i < ids.ids_size(); ++i) {
    if (ids.ids(i) < 0 || ids.ids(i) >= n)
      c.breach.require(false, entry(field + ".ids", i),
                       "is " + std::to_string(ids.ids(i)) + ", must be a node of the mesh, below " + std::to_string(n));
    else
      selected[static_cast<std::size_t>(ids.ids(i))] = 1;
  }
}

void mark(const v1::NodeSelection& selection, const NodeBox& bounds, const std::vector<Vec3>& X,
          std::vector<char>& selected, const std::string& field, Conversion& c) {
  double tolerance = kDefaultTolerance * bounds.diagonal().norm();
  if (selection.has_tolerance()) {
    c.breach.number(selection.tolerance(), {0, 1e4}, field + ".tolerance");
    tolerance = selection.tolerance();
  }
  switch (selection.by_case()) {
    case v1::NodeSelection::kBox:
      return mark_box(selection.box(), tolerance, X, selected, field + ".box", c);
    case v1::NodeSelection::kFace:
      return mark_face(selection.face(), tolerance, bounds, X, selected, field + ".face", c);
    case v1::NodeSelection::kIds:
      return mark_ids(selection.ids(), selected, field + ".ids", c);
    case v1::NodeSelection::BY_NOT_SET:
      c.breach.require(false, field, "is empty, must be one of box, face, ids");
  }
}

}  // namespace

std::vector<sim::PoseKey> to_keys(const google::protobuf::RepeatedPtrField<v1::PoseKey>& messages,
                                  const std::string& field, Conversion& c) {
  std::vector<sim::PoseKey> keys;
  for (int i = 0; c.breach.ok() && i < messages.size(); ++i) {
    const std::string pose = entry(field, i) + ".pose";
    keys.push_back({messages[i].time(), c.value(to_pose(messages[i].pose(), pose), "")});
  }
  return keys;
}

std::vector<int> to_nodes(const google::protobuf::RepeatedPtrField<v1::NodeSelection>& messages,
                          const sim::TetMesh& mesh, const std::string& field, Conversion& c) {
  const NodeBox bounds = bounding_box(mesh.X);
  std::vector<char> selected(mesh.X.size(), 0);
  for (int i = 0; c.breach.ok() && i < messages.size(); ++i)
    mark(messages[i], bounds, mesh.X, selected, entry(field, i), c);
  std::vector<int> nodes;
  for (std::size_t i = 0; i < selected.size(); ++i)
    if (selected[i]) nodes.push_back(static_cast<int>(i));
  c.breach.require(!nodes.empty(), field, "selects no node of the mesh, must select one at least");
  return nodes;
}

}  // namespace crumple::scene_convert
