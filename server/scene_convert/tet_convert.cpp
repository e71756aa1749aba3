#include "server/scene_convert/tet_convert.h"

#include "server/authoring/shapes/box_lattice.h"
#include "server/scene_convert/asset_convert.h"
#include "server/scene_convert/enclosing_convert.h"
#include "server/scene_convert/geometry_convert.h"
#include "server/scene_convert/surface_convert.h"

namespace crumple::scene_convert {
namespace {

constexpr sim::Range kSize{1e-4, 1e4};   // of generated shapes [m]
constexpr sim::Range kScale{1e-6, 1e6};  // [-]
constexpr sim::Range kCells{1, 1000};

struct Block {
  std::array<int, 3> cells;
  authoring::Lattice lattice = authoring::Lattice::kuhn;
};

Block to_block(bool given, const v1::Cells& message, const std::array<int, 3>& missing, const std::string& field,
               Conversion& c) {
  Block block{missing};
  if (given) block.cells = {message.x(), message.y(), message.z()};
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  for (std::size_t i = 0; i < 3; ++i) c.breach.number(block.cells[i], kCells, field + kAxes[i]);
  switch (int{message.lattice()}) {
    case v1::Cells::KUHN:
      break;
    case v1::Cells::FEMFX:
      block.lattice = authoring::Lattice::femfx;
      break;
    case v1::Cells::BCC:
      block.lattice = authoring::Lattice::bcc;
      break;
    default:
      c.breach.require(false, field + ".lattice",
                       "is " + std::to_string(message.lattice()) + ", must be KUHN, FEMFX or BCC");
  }
  return block;
}

sim::TetMesh make_box(const v1::BoxTets& m, const std::string& field, Conversion& c) {
  static constexpr const char* kAxes[] = {".x", ".y", ".z"};
  const Vec3 size = to_vec3(m.has_size(), m.size(), Vec3::Ones());
  for (int i = 0; i < 3; ++i) c.breach.number(size[i], kSize, field + ".size" + kAxes[i]);
  const Block block = to_block(m.has_cells(), m.cells(), {2, 2, 2}, field + ".cells", c);
  if (!c.breach.ok()) return {};
  return c.value(authoring::centred_box_mesh(size, block.cells, block.lattice), field);
}

sim::TetMesh make_beam(const v1::BeamTets& m, const std::string& field, Conversion& c) {
  const Vec3 size(number_or(m.has_length(), m.length(), 2, kSize, field + ".length", c),
                  number_or(m.has_height(), m.height(), 0.4, kSize, field + ".height", c),
                  number_or(m.has_depth(), m.depth(), 0.4, kSize, field + ".depth", c));
  const Block block = to_block(m.has_cells(), m.cells(), {25, 4, 4}, field + ".cells", c);
  if (!c.breach.ok()) return {};
  return c.value(authoring::beam(size, block.cells, block.lattice), field);
}

sim::TetMesh make_pane(const v1::PaneTets& m, const std::string& field, Conversion& c) {
  const double width = number_or(m.has_width(), m.width(), 2, kSize, field + ".width", c);
  const double height = number_or(m.has_height(), m.height(), 2, kSize, field + ".height", c);
  const double thickness = number_or(m.has_thickness(), m.thickness(), 0.05, kSize, field + ".thickness", c);
  const Block block = to_block(m.has_cells(), m.cells(), {20, 20, 1}, field + ".cells", c);
  if (!c.breach.ok()) return {};
  return c.value(authoring::pane(width, height, thickness, block.cells, block.lattice), field);
}

sim::TetMesh make_enclosing(const v1::EnclosingTets& m, const std::string& field, Conversion& c) {
  const authoring::EnclosingOptions options = to_enclosing(m, field, c);
  const auto surface = to_shared_surface(m.surface(), field + ".surface", c);
  if (!c.breach.ok()) return {};
  return c.value(authoring::enclosing_mesh(*surface, options), field).mesh;
}

sim::TetMesh make_tets(const v1::TetSource& message, const std::string& field, Conversion& c) {
  using Source = v1::TetSource;
  switch (message.source_case()) {
    case Source::kBox:
      return make_box(message.box(), field + ".box", c);
    case Source::kBeam:
      return make_beam(message.beam(), field + ".beam", c);
    case Source::kPane:
      return make_pane(message.pane(), field + ".pane", c);
    case Source::kEnclosing:
      return make_enclosing(message.enclosing(), field + ".enclosing", c);
    case Source::kFile:
      return c.value(c.files.tets(message.file()), field + ".file");
    case Source::kInlineMesh:
      return c.value(to_tet_mesh(message.inline_mesh(), field + ".inline_mesh"), "");
    case Source::SOURCE_NOT_SET:
      break;
  }
  c.breach.require(false, field, "has no source, must be one of box, beam, pane, enclosing, file, inline_mesh");
  return {};
}

}  // namespace

std::shared_ptr<const sim::TetMesh> to_shared_tets(const v1::TetSource& message, const std::string& field,
                                                   Conversion& c) {
  if (!c.breach.ok()) return nullptr;
  std::shared_ptr<const sim::TetMesh>& shared = c.tet_meshes[message.SerializeAsString()];
  if (shared) return shared;
  const double scale = number_or(message.has_scale(), message.scale(), 1, kScale, field + ".scale", c);
  sim::TetMesh mesh = make_tets(message, field, c);
  if (!c.breach.ok()) return nullptr;
  for (Vec3& p : mesh.X) p *= scale;
  return shared = std::make_shared<const sim::TetMesh>(std::move(mesh));
}

}  // namespace crumple::scene_convert
