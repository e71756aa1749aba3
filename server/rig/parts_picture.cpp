#include "server/rig/parts_picture.h"

#include "common/text.h"
#include "server/io/png_writer.h"
#include "server/lab/raster.h"
#include "server/lab/scene_picture.h"
#include "server/rig/broken_scene.h"

#include <cmath>

namespace crumple::rig {
namespace {

constexpr int kTile = 480;
constexpr double kFieldOfView = 0.5, kApart = 0.35;  // of a part's way from the middle

struct View {
  Topology topology;
  Frame frame;
};

View view_of(const authoring::PrescoredAsset& asset, const Vec3& middle, double apart) {
  View out;
  for (std::size_t p = 0; p < asset.parts.size(); ++p) {
    const sim::SurfaceMesh& drawn = asset.parts[p].set.render;
    BodyTopology body;
    body.id = static_cast<std::uint32_t>(p);
    body.deformable = true;
    body.colour = part_colour(p);
    std::vector<Vec3> x = drawn.vertices;
    if (drawn.triangles.empty()) {
      x = asset.parts[p].set.mesh.X;
      for (const auto& face : sim::surface_faces(asset.parts[p].set.mesh.tets)) body.triangles.push_back(face.nodes);
    } else {
      body.triangles = drawn.triangles;
    }
    Eigen::AlignedBox3d box;
    for (const Vec3& v : x) box.extend(v);
    for (const Vec3& v : x) body.vertices.push_back((v + apart * (box.center() - middle)).cast<float>());
    BodyFrame at;
    at.id = body.id;
    at.positions = body.vertices;
    out.topology.bodies.push_back(std::move(body));
    out.frame.bodies.push_back(std::move(at));
  }
  return out;
}

struct Sheet {
  lab::Camera camera;
  std::array<View, 2> views;
};

Sheet sheet_of(const authoring::PrescoredAsset& asset) {
  Eigen::AlignedBox3d box, apart;
  for (const auto& part : asset.parts)
    for (const Vec3& X : part.set.mesh.X) box.extend(X);
  Sheet sheet{{}, {view_of(asset, box.center(), 0), view_of(asset, box.center(), kApart)}};
  for (const BodyTopology& body : sheet.views[1].topology.bodies)
    for (const Vec3f& v : body.vertices) apart.extend(v.cast<double>());
  sheet.camera = {.eye = apart.center() + 0.5 * apart.diagonal().norm() / std::tan(kFieldOfView / 2) *
                                              Vec3(0.62, 0.42, 0.9).normalized(),
                  .target = apart.center(),
                  .field_of_view = kFieldOfView};
  return sheet;
}

}  // namespace

std::string parts_png(const authoring::PrescoredAsset& asset) {
  const Sheet sheet = sheet_of(asset);
  lab::Raster raster(2 * kTile, kTile, {0xf4, 0xf5, 0xf7});
  for (int k = 0; k < 2; ++k)
    raster.draw(lab::patches(sheet.views[k].topology, sheet.views[k].frame, sheet.camera, kTile, kTile), kTile * k, 0,
                kTile, kTile);
  return io::png_of(raster.rgb(), 2 * kTile, kTile);
}

std::string parts_svg(const authoring::PrescoredAsset& asset) {
  const Sheet sheet = sheet_of(asset);
  std::string svg = text("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", 2 * kTile, "\" height=\"", kTile,
                         "\">\n<rect width=\"", 2 * kTile, "\" height=\"", kTile, "\" fill=\"#f4f5f7\"/>\n");
  for (int k = 0; k < 2; ++k)
    svg += lab::svg_tile(sheet.views[k].topology, sheet.views[k].frame, sheet.camera, kTile * k, 0, kTile, kTile);
  return svg + "</svg>\n";
}

}  // namespace crumple::rig
