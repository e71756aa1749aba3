#include "server/scene_convert/splinter_convert.h"

#include "server/authoring/splinter_cut.h"
#include "server/scene_convert/generated_shape.h"
#include "server/scene_convert/geometry_convert.h"

namespace crumple::scene_convert {
namespace {

using Cells = Result<std::vector<authoring::SplinterCell>>;

constexpr sim::Range kSize{1e-4, 1e4};  // [m]
constexpr sim::Range kAspect{1, 1000};  // [-]

Vec3 to_grain(const v1::WoodSplinters& wood, const std::string& field, Conversion& c) {
  const Vec3 grain = to_vec3(wood.has_grain(), wood.grain(), Vec3::UnitY());
  c.breach.vector(grain, sim::kMaxPosition, field);
  c.breach.require(grain.norm() > 0, field, "is zero, must be a direction");
  return grain.normalized();
}

Vec3 to_block(const v1::BrickSplinters& brick, const std::string& field, Conversion& c) {
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  const Vec3 size = to_vec3(brick.has_size(), brick.size(), Vec3(0.24, 0.08, 0.12));
  for (int a = 0; a < 3; ++a) c.breach.number(size[a], kSize, field + kAxes[a]);
  return size;
}

// The cells of all cuts but `given`.
Cells make_cells(const v1::Splinters& m, const Eigen::AlignedBox3d& box, const std::string& field, Conversion& c) {
  const std::uint64_t seed = m.has_seed() ? m.seed() : 1;
  const auto size = [&](const auto& cut, double missing) {
    return number_or(cut.has_size(), cut.size(), missing, kSize, field + ".size", c);
  };
  const auto made = [&](const auto& make) { return c.breach.ok() ? make() : Cells(); };
  switch (m.pieces_case()) {
    case v1::Splinters::kStone: {
      const double s = size(m.stone(), 0.1);
      return made([&] { return authoring::stone_cells(box, s, seed); });
    }
    case v1::Splinters::kGlass: {
      const double s = size(m.glass(), 0.1);
      return made([&] { return authoring::glass_cells(box, s, seed); });
    }
    case v1::Splinters::kWood: {
      const double s = size(m.wood(), 0.03);
      const double aspect = number_or(m.wood().has_aspect(), m.wood().aspect(), 10, kAspect, field + ".aspect", c);
      const Vec3 grain = to_grain(m.wood(), field + ".grain", c);
      return made([&] { return authoring::wood_cells(box, s, aspect, grain, seed); });
    }
    default: {
      const Vec3 block = to_block(m.brick(), field + ".size", c);
      return made([&] { return authoring::brick_cells(box, block); });
    }
  }
}

const char* name_of(v1::Splinters::PiecesCase pieces) {
  switch (pieces) {
    case v1::Splinters::kStone: return ".stone";
    case v1::Splinters::kGlass: return ".glass";
    case v1::Splinters::kWood: return ".wood";
    default: return ".brick";
  }
}

sim::SplinterMesh make_splinters(const v1::Splinters& m, const sim::SurfaceMesh& surface, bool of_render,
                                 const std::string& body, Conversion& c) {
  const std::string field = body + ".splinters";
  if (m.pieces_case() == v1::Splinters::PIECES_NOT_SET) {
    c.breach.require(false, field, "has no pieces, must be one of given, stone, glass, wood, brick");
    return {};
  }
  for (std::size_t v = 0; c.breach.ok() && v < surface.vertices.size(); ++v)
    c.breach.vector(surface.vertices[v], sim::kMaxPosition, entry(body + (of_render ? ".render.vertices" : ".mesh.X"), static_cast<int>(v)));
  if (!c.breach.ok()) return {};
  if (m.has_given()) {
    c.breach.require(of_render, field + ".given", "has no surface to take, needs render");
    return c.breach.ok() ? authoring::given_splinters(surface) : sim::SplinterMesh();
  }
  const authoring::Polyhedron solid = c.value(authoring::polyhedron_of(surface), of_render ? body + ".render" : body + ".mesh");
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.vertices) box.extend(p);
  const std::string cut = field + name_of(m.pieces_case());
  Cells cells = make_cells(m, box, cut, c);
  const std::vector<authoring::SplinterCell> made = c.value(std::move(cells), cut);
  if (!c.breach.ok()) return {};
  sim::SplinterMesh mesh = c.value(authoring::cut_splinters(solid, made), cut);
  c.breach.require(!c.breach.ok() || mesh.count > 0, cut, "leaves no pieces");
  return mesh;
}

}  // namespace

std::shared_ptr<const sim::SplinterMesh> to_shared_splinters(const v1::FemBody& body, const sim::TetMesh& mesh,
                                                             const sim::SurfaceMesh* render, const std::string& field,
                                                             Conversion& c) {
  if (!c.breach.ok()) return nullptr;
  v1::FemBody source;  // what they are made of
  *source.mutable_splinters() = body.splinters();
  if (render) {
    *source.mutable_render() = body.render();
  } else {
    *source.mutable_mesh() = body.mesh();
  }
  std::shared_ptr<const sim::SplinterMesh>& shared = c.splinter_meshes[source.SerializeAsString()];
  if (shared) return shared;
  const sim::SurfaceMesh surface = render ? *render : authoring::surface_of(mesh);
  sim::SplinterMesh made = make_splinters(body.splinters(), surface, render != nullptr, field, c);
  if (!c.breach.ok()) return nullptr;
  return shared = std::make_shared<const sim::SplinterMesh>(std::move(made));
}

}  // namespace crumple::scene_convert
