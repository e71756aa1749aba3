#include "server/rig/rig_picture.h"

#include "common/text.h"
#include "server/authoring/pose_fit.h"
#include "server/io/png_writer.h"
#include "server/lab/scene_picture.h"
#include "server/lab/raster.h"
#include "server/sim/mesh/embedding.h"

#include <algorithm>
#include <cmath>

namespace crumple::rig {
namespace {

using sim::example_based::ExampleSet;

constexpr int kTile = 300, kCaption = 26, kColumns = 4;
constexpr double kFieldOfView = 0.5;

// What is drawn, at rest: the render surface, or the tets' own.
struct Drawn {
  std::vector<Triangle> triangles;
  sim::Embedding embedding;  // empty: the nodes themselves

  explicit Drawn(const ExampleSet& set) : triangles(set.render.triangles) {
    if (!triangles.empty()) {
      embedding = sim::embed(set.render.vertices, set.mesh);
    } else {
      for (const auto& face : sim::surface_faces(set.mesh.tets)) triangles.push_back(face.nodes);
    }
  }
  std::vector<Vec3> vertices(const ExampleSet& set, const std::vector<Vec3>& x) const {
    if (embedding.tet.empty()) return x;
    std::vector<Vec3> out(embedding.tet.size());
    sim::embedded_positions(embedding, set.mesh.tets, x, out);
    return out;
  }
};

std::vector<Vec3f> to_float(const std::vector<Vec3>& x) {
  std::vector<Vec3f> out;
  for (const Vec3& p : x) out.push_back(p.cast<float>());
  return out;
}

std::string xml(const std::string& words) {
  std::string out;
  for (const char c : words) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (static_cast<unsigned char>(c) >= 32)
      out += c;
  }
  return out;
}

struct Tile {
  Topology topology;
  Frame frame;
  std::string caption;
};

struct Sheet {
  lab::Camera camera;
  std::vector<Tile> tiles;

  int columns() const { return std::min(static_cast<int>(tiles.size()), kColumns); }
  int rows() const { return (static_cast<int>(tiles.size()) + kColumns - 1) / kColumns; }
};

void add_markers(const ExampleSet& set, double size, Topology& topology, Frame& frame) {
  constexpr int kFaces[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  BodyTopology body;
  body.id = 1;
  body.deformable = true;
  body.colour = {0.02f, 0.05f, 0.3f};
  BodyFrame at;
  at.id = 1;
  for (const auto& handle : set.handles) {
    const int first = static_cast<int>(at.positions.size());
    for (int k = 0; k < 6; ++k)
      at.positions.push_back((handle.position + (k % 2 ? -size : size) * Vec3::Unit(k / 2)).cast<float>());
    for (const auto& [a, b, c] : kFaces) body.triangles.push_back({first + a, first + b, first + c});
  }
  body.vertices = at.positions;
  topology.bodies.push_back(std::move(body));
  frame.bodies.push_back(std::move(at));
}

Sheet sheet_of(const ExampleSet& set) {
  const Drawn drawn(set);
  std::vector<std::vector<Vec3>> shapes;
  for (const auto& example : set.examples)
    shapes.push_back(drawn.vertices(set, authoring::skinned(set, example.bones)));
  Eigen::AlignedBox3d box;
  double largest = 0;
  for (const auto& shape : shapes)
    for (std::size_t i = 0; i < shape.size(); ++i) {
      box.extend(shape[i]);
      largest = std::max(largest, (shape[i] - shapes[0][i]).norm());
    }
  const double size = box.diagonal().norm();
  Sheet sheet{
      .camera = {.eye = box.center() + 0.54 * size / std::tan(kFieldOfView / 2) * Vec3(0.62, 0.42, 0.9).normalized(),
                 .target = box.center(),
                 .field_of_view = kFieldOfView}};

  Topology topology;
  BodyTopology body;
  body.deformable = true;
  body.triangles = drawn.triangles;
  body.colour = {0.42f, 0.5f, 0.6f};
  body.vertices = to_float(shapes[0]);
  topology.bodies.push_back(body);
  {
    Topology with_handles = topology;
    with_handles.bodies[0].opacity = 0.15f;
    Frame frame;
    frame.bodies.resize(1);
    frame.bodies[0].positions = body.vertices;
    add_markers(set, 0.012 * size, with_handles, frame);
    sheet.tiles.push_back({with_handles, frame, text(set.bone_count(), " handles")});
  }
  for (std::size_t e = 0; e < shapes.size(); ++e) {
    Frame frame;
    frame.bodies.resize(1);
    frame.bodies[0].positions = to_float(shapes[e]);
    for (std::size_t i = 0; i < shapes[e].size(); ++i)
      frame.bodies[0].values.push_back(largest > 0 ? static_cast<float>((shapes[e][i] - shapes[0][i]).norm() / largest)
                                                   : 0.0f);
    sheet.tiles.push_back({topology, frame, set.examples[e].name});
  }
  return sheet;
}

}  // namespace

std::string rig_svg(const ExampleSet& set) {
  const Sheet sheet = sheet_of(set);
  const int width = kTile * sheet.columns(), height = (kTile + kCaption) * sheet.rows();
  std::string svg = text("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", width, "\" height=\"", height,
                         "\">\n<rect width=\"", width, "\" height=\"", height, "\" fill=\"#f4f5f7\"/>\n");
  for (std::size_t k = 0; k < sheet.tiles.size(); ++k) {
    const Tile& tile = sheet.tiles[k];
    const int x = kTile * (static_cast<int>(k) % kColumns), y = (kTile + kCaption) * (static_cast<int>(k) / kColumns);
    svg += lab::svg_tile(tile.topology, tile.frame, sheet.camera, x, y, kTile, kTile);
    svg += text("<text x=\"", x + 10, "\" y=\"", y + kTile + 16,
                "\" font-family=\"sans-serif\" font-size=\"14\" fill=\"#222\">", xml(tile.caption), "</text>\n");
  }
  return svg + "</svg>\n";
}

std::string rig_png(const ExampleSet& set) {
  const Sheet sheet = sheet_of(set);
  const int width = kTile * sheet.columns(), height = kTile * sheet.rows();
  lab::Raster raster(width, height, {0xf4, 0xf5, 0xf7});
  for (std::size_t k = 0; k < sheet.tiles.size(); ++k) {
    const Tile& tile = sheet.tiles[k];
    raster.draw(lab::patches(tile.topology, tile.frame, sheet.camera, kTile, kTile),
                kTile * (static_cast<int>(k) % kColumns), kTile * (static_cast<int>(k) / kColumns), kTile, kTile);
  }
  return io::png_of(raster.rgb(), width, height);
}

}  // namespace crumple::rig
