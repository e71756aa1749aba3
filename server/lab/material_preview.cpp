#include "server/lab/material_preview.h"

#include "common/text.h"
#include "crumple/v1/scene.pb.h"
#include "server/io/message_json.h"
#include "server/io/scene_file.h"
#include "server/io/write_file.h"
#include "server/lab/scene_picture.h"
#include "server/sim/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

namespace crumple::lab {
namespace {

constexpr double kDt = 1.0 / 120;
constexpr int kSteps = 360, kMostLoaded = 150;  // pressing and bending end at 1.25 s
constexpr double kSize = 1.2, kThickness = 0.1, kHeight = 1.2, kApart = 2.2;  // [m]
constexpr int kTileWidth = 440, kTileHeight = 330, kMargin = 34;
constexpr std::array kNames{"pushed", "bent", "struck"};

void set(v1::Vec3* to, double x, double y, double z) {
  to->set_x(x);
  to->set_y(y);
  to->set_z(z);
}

v1::Body& add_body(v1::Scene& scene, const std::string& name, double x, double y, std::array<float, 3> colour) {
  v1::Body& body = *scene.add_bodies();
  body.set_name(name);
  set(body.mutable_pose()->mutable_position(), x, y, 0);
  body.mutable_colour()->set_r(colour[0]);
  body.mutable_colour()->set_g(colour[1]);
  body.mutable_colour()->set_b(colour[2]);
  return body;
}

v1::NodeMotion& hold(v1::FemBody& panel, std::initializer_list<const char*> faces) {
  v1::NodeMotion& motion = *panel.add_motions();
  for (const char* face : faces) motion.add_nodes()->set_face(face);
  return motion;
}

// A panel as the files say.
struct Stuff {
  v1::FemMaterial material;
  std::optional<v1::Splinters> splinters;
};

v1::FemBody& add_panel(v1::Scene& scene, int index, const Stuff& stuff) {
  v1::Body& body = add_body(scene, kNames[index], kApart * (index - 1), kHeight, {0.45f, 0.55f, 0.65f});
  v1::FemBody& panel = *body.mutable_fem();
  *panel.mutable_material() = stuff.material;
  if (stuff.splinters) *panel.mutable_splinters() = *stuff.splinters;
  auto& box = *panel.mutable_mesh()->mutable_box();
  set(box.mutable_size(), kSize, kThickness, kSize);
  box.mutable_cells()->set_x(12);
  box.mutable_cells()->set_y(1);
  box.mutable_cells()->set_z(12);
  return panel;
}

v1::RigidBody& add_ball(v1::Scene& scene, const std::string& name, double x, double y, double radius) {
  v1::Body& body = add_body(scene, name, x, y, {0.25f, 0.25f, 0.27f});
  body.mutable_rigid()->add_shapes()->mutable_sphere()->set_radius(radius);
  return *body.mutable_rigid();
}

v1::Scene scene_of(const Stuff& stuff, const std::string& name) {
  v1::Scene scene;
  scene.set_name(name);
  scene.set_dt(kDt);
  v1::Body& ground = add_body(scene, "ground", 0, 0, {0.42f, 0.43f, 0.45f});
  ground.mutable_rigid()->set_kind(v1::RigidBody::FIXED);
  ground.mutable_rigid()->add_shapes()->mutable_plane();

  hold(add_panel(scene, 0, stuff), {"x_min", "x_max"});
  const double radius = 0.2, above = kHeight + kThickness / 2 + radius + 0.01;
  v1::RigidBody& press = add_ball(scene, "press", -kApart, above, radius);
  press.set_kind(v1::RigidBody::KINEMATIC);
  for (const auto& [time, y] : {std::pair(0.0, above), {1.0, above - 0.3}, {1.25, above - 0.3}, {2.25, above + 0.2}}) {
    v1::PoseKey& key = *press.add_motion();
    key.set_time(time);
    set(key.mutable_pose()->mutable_position(), -kApart, y, 0);
  }

  v1::FemBody& bent = add_panel(scene, 1, stuff);
  hold(bent, {"x_min"});
  v1::NodeMotion& edge = hold(bent, {"x_max"});
  for (int k = 0; k <= 20; ++k) {
    // Round an arc of the panel's length, then back to where it was.
    const double time = 2.25 * k / 20, part = time < 1 ? time : time < 1.25 ? 1 : 2.25 - time;
    const double angle = 70 * M_PI / 180 * part;
    v1::PoseKey& key = *edge.add_keys();
    key.set_time(time);
    set(key.mutable_pose()->mutable_rotation_vector(), 0, 0, angle);
    // The edge's middle is at (size / 2, 0, 0); on an arc from (-size / 2, 0, 0) on it is at (r sin, r (1 - cos)) from there.
    const double r = angle > 1e-9 ? kSize / angle : 0;
    const double x = angle > 1e-9 ? r * std::sin(angle) : kSize, y = angle > 1e-9 ? r * (1 - std::cos(angle)) : 0;
    set(key.mutable_pose()->mutable_position(), -kSize / 2 + x - kSize / 2 * std::cos(angle), y - kSize / 2 * std::sin(angle), 0);
  }

  hold(add_panel(scene, 2, stuff), {"x_min", "x_max"});
  v1::RigidBody& ball = add_ball(scene, "ball", kApart, kHeight + kThickness / 2 + 0.16, 0.15);
  ball.set_mass(100);
  set(scene.mutable_bodies(scene.bodies_size() - 1)->mutable_velocity(), 0, -20, 0);
  return scene;
}

template <class Message>
Result<Message> read_message(const std::filesystem::path& file, const std::string& field) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream content;
  if (!in || !(content << in.rdbuf())) {
    return std::unexpected(Error{ErrorCode::invalid_argument, field, text("is ", file.string(), ", must be a file that can be read")});
  }
  Message message;
  if (auto read = io::parse_json(content.str(), message); !read) {
    return std::unexpected(io::with_line(read.error(), content.str(), file.filename().string()));
  }
  return message;
}

std::string caption(int x, int y, const std::string& words) {
  return text("<text x=\"", x, "\" y=\"", y, "\" font-family=\"sans-serif\" font-size=\"15\" fill=\"#222\">", words, "</text>\n");
}

Camera camera_of(int panel) {
  const Vec3 middle(kApart * (panel - 1), kHeight - 0.25, 0);
  return {.eye = middle + Vec3(-1.1, 1.6, 3.4), .target = middle, .field_of_view = 0.62};
}

// The panel alone, and its ball.
Frame only(const Frame& frame, const sim::World& world, int panel) {
  Frame part = frame;
  std::erase_if(part.bodies, [&](const BodyFrame& body) {
    const std::string& name = world.topology().bodies[body.id].name;
    return name != kNames[panel] && !(panel == 0 && name == "press") && !(panel == 2 && name == "ball");
  });
  return part;
}

std::string row_of(const sim::World& world, int y) {
  const Frame frame = world.capture(true);
  std::string row;
  for (int panel = 0; panel < 3; ++panel) {
    row += svg_tile(world.topology(), only(frame, world, panel), camera_of(panel), panel * kTileWidth, y, kTileWidth, kTileHeight);
  }
  return row;
}

}  // namespace

Result<std::string> preview_scene(const PreviewFiles& files) {
  const auto material = read_message<v1::FemMaterial>(files.material, "material");
  if (!material) return std::unexpected(material.error());
  Stuff stuff{*material, {}};
  if (!files.splinters.empty()) {
    const auto splinters = read_message<v1::Splinters>(files.splinters, "splinters");
    if (!splinters) return std::unexpected(splinters.error());
    stuff.splinters = *splinters;
  }
  return io::print_json(scene_of(stuff, text("preview of ", files.material.stem().string())));
}

Result<nlohmann::json> preview_material(const PreviewFiles& files, const std::filesystem::path& folder) {
  const auto json = preview_scene(files);
  if (!json) return std::unexpected(json.error());
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const std::filesystem::path scene_file = folder / "preview.json";
  if (auto written = io::write_file(scene_file, *json); !written) return std::unexpected(written.error());
  const auto loaded = io::load_scene(scene_file);
  if (!loaded) return std::unexpected(loaded.error());
  auto world = sim::World::create(loaded->scene);
  if (!world) return std::unexpected(world.error());

  const int width = 3 * kTileWidth, height = 2 * (kTileHeight + kMargin);
  std::string svg = text("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", width, "\" height=\"", height, "\">\n<rect width=\"",
                         width, "\" height=\"", height, "\" fill=\"#f4f5f7\"/>\n");
  std::array<double, 3> most{};  // von Mises stress [Pa]
  const std::array<BodyId, 3> panels{(*world)->find("pushed"), (*world)->find("bent"), (*world)->find("struck")};
  for (int k = 1; k <= kSteps; ++k) {
    (*world)->step();
    if (k % 10 == 0) {
      for (int p = 0; p < 3; ++p) {
        const sim::FemView view = (*world)->fem(panels[p]);
        most[p] = std::max(most[p], *std::ranges::max_element(view.von_mises));
      }
    }
    if (k == kMostLoaded) svg += row_of(**world, kMargin);
  }
  svg += row_of(**world, 2 * kMargin + kTileHeight);
  const std::filesystem::path picture = folder / "preview.svg";
  nlohmann::json result{{"scene", scene_file.string()}, {"picture", picture.string()}};
  for (int p = 0; p < 3; ++p) {
    const sim::FemView view = (*world)->fem(panels[p]);
    double plastic = 0;
    for (const Mat3& strain : view.plastic_strain) plastic = std::max(plastic, strain.norm());
    result[kNames[p]] = {{"pieces", view.fragments}, {"rigid_pieces", view.rigid_fragments}, {"stress_largest", most[p]},
                         {"plastic_strain_largest", plastic}};
    const std::string words = text(kNames[p], p == 2 ? ", after 1.25 s" : ", held at its most");
    svg += caption(p * kTileWidth + 14, 23, words);
    svg += caption(p * kTileWidth + 14, kTileHeight + kMargin + 23, text("after 3 s: ", view.fragments, view.fragments == 1 ? " piece" : " pieces"));
  }
  svg += "</svg>\n";
  if (auto written = io::write_file(picture, svg); !written) return std::unexpected(written.error());
  return result;
}

}  // namespace crumple::lab
