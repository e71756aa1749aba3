#include "server/authoring/rig_handles.h"

#include "common/text.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

namespace crumple::authoring {
namespace {

constexpr std::size_t kMaxNameBytes = 256;
constexpr double kMaxPosition = 1e6;  // [m]

Result<void> check_name(const std::string& name, const std::string& field, std::set<std::string>& names) {
  if (name.empty() || name.size() > kMaxNameBytes)
    return invalid(field, text("has ", name.size(), " bytes, must have 1 to ", kMaxNameBytes));
  if (!names.insert(name).second) return invalid(field, "is \"" + name + "\", which another handle has");
  return {};
}

Result<void> check_position(const Vec3& p, const std::string& field) {
  if (p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxPosition) return {};
  return invalid(field, "must be finite and within 1e6 m");
}

std::string name_in(const NamedCage& cage, std::size_t point) { return text(cage.name, " ", point + 1); }

// Edges or faces; marks the points that they use.
Result<void> check_ids(std::span<const int> ids, const std::string& field, std::vector<char>& used) {
  for (std::size_t k = 0; k < ids.size(); ++k) {
    if (ids[k] < 0 || ids[k] >= static_cast<int>(used.size()))
      return invalid(field, text("names point ", ids[k], ", must be in [0, ", used.size(), ")"));
    if (std::ranges::count(ids, ids[k]) > 1) return invalid(field, text("names point ", ids[k], " twice"));
    used[ids[k]] = true;
  }
  return {};
}

Result<void> check_cage(const NamedCage& cage, const std::string& at, std::set<std::string>& names) {
  if (cage.name.empty()) return invalid(at + ".name", "has 0 bytes, must have 1 to 256");
  if (cage.edges.empty() && cage.faces.empty())
    return invalid(at, "has no edges and no triangles, must have some: points alone are `handles`");
  for (std::size_t p = 0; p < cage.points.size(); ++p) {
    if (auto ok = check_position(cage.points[p], text(at, ".points[", p, "]")); !ok) return ok;
    if (auto ok = check_name(name_in(cage, p), at + ".name", names); !ok) return ok;
  }
  std::vector<char> used(cage.points.size(), false);
  for (std::size_t e = 0; e < cage.edges.size(); ++e)
    if (auto ok = check_ids(cage.edges[e], text(at, ".edges[", e, "]"), used); !ok) return ok;
  for (std::size_t f = 0; f < cage.faces.size(); ++f)
    if (auto ok = check_ids(cage.faces[f], text(at, ".triangles[", f, "]"), used); !ok) return ok;
  const auto loose = std::ranges::find(used, false);
  if (loose != used.end())
    return invalid(text(at, ".points[", loose - used.begin(), "]"), "is in no edge and no triangle, must be in one");
  return {};
}

}  // namespace

Result<void> validate(const GivenHandles& given) {
  std::set<std::string> names;
  if (given.empty()) return invalid("handles", "is empty, must have at least one, or bones or cages");
  for (std::size_t p = 0; p < given.points.size(); ++p) {
    const std::string at = text("handles[", p, "]");
    if (auto ok = check_name(given.points[p].name, at + ".name", names); !ok) return ok;
    if (auto ok = check_position(given.points[p].position, at + ".position"); !ok) return ok;
  }
  for (std::size_t b = 0; b < given.bones.size(); ++b) {
    const NamedBone& bone = given.bones[b];
    const std::string at = text("bones[", b, "]");
    if (auto ok = check_name(bone.name, at + ".name", names); !ok) return ok;
    if (auto ok = check_position(bone.from, at + ".from"); !ok) return ok;
    if (auto ok = check_position(bone.to, at + ".to"); !ok) return ok;
    if (bone.from == bone.to) return invalid(at + ".to", "is where `from` is, must be elsewhere");
  }
  for (std::size_t c = 0; c < given.cages.size(); ++c)
    if (auto ok = check_cage(given.cages[c], text("cages[", c, "]"), names); !ok) return ok;
  return {};
}

bool RigHandles::are_points() const {
  return shapes.cage_edges.empty() && shapes.cage_faces.empty() &&
         std::ranges::all_of(shapes.handles, &Handle::is_point);
}

void RigHandles::add_point(const sim::example_based::Handle& point) {
  named.push_back(point);
  shapes.handles.push_back(Handle::point(point.position));
}

void RigHandles::add_bone(const NamedBone& bone) {
  named.push_back({bone.name, bone.from});
  shapes.handles.push_back({bone.from, bone.to});
}

void RigHandles::add_cage(const NamedCage& cage) {
  const int first = count();
  for (std::size_t p = 0; p < cage.points.size(); ++p) add_point({name_in(cage, p), cage.points[p]});
  for (auto [a, b] : cage.edges) shapes.cage_edges.push_back({first + a, first + b});
  for (auto [a, b, c] : cage.faces) shapes.cage_faces.push_back({first + a, first + b, first + c});
}

void RigHandles::add(const GivenHandles& given) {
  for (const auto& point : given.points) add_point(point);
  for (const NamedBone& bone : given.bones) add_bone(bone);
  for (const NamedCage& cage : given.cages) add_cage(cage);
}

std::vector<Vec3> places_of(const Handles& handles) {
  std::vector<Vec3> out;
  for (const Handle& h : handles.handles)
    for (int k = 0; k <= (h.is_point() ? 0 : 4); ++k) out.push_back(h.from + k / 4.0 * (h.to - h.from));
  return out;
}

double distance_outside(const sim::TetTree& tree, const Handle& handle, double spacing) {
  const double length = (handle.to - handle.from).norm();
  const int n = static_cast<int>(std::clamp(std::ceil(length / spacing), 1.0, 10000.0));
  double nearest = tree.nearest(handle.from).squared_distance;
  for (int k = 1; !handle.is_point() && k <= n; ++k)
    nearest = std::min(nearest, tree.nearest(handle.from + k * (handle.to - handle.from) / n).squared_distance);
  return std::sqrt(nearest);
}

}  // namespace crumple::authoring
