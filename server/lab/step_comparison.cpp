#include "server/lab/step_comparison.h"

#include "common/text.h"
#include "server/io/mesh_file.h"
#include "server/io/png_writer.h"
#include "server/io/scene_file.h"
#include "server/io/write_file.h"
#include "server/lab/raster.h"
#include "server/sim/world.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace crumple::lab {
namespace {

using Step = sim::example_based::ExampleParameters::Step;
using nlohmann::json;

constexpr std::pair<Step, const char*> kSteps[] = {
    {Step::equation8, "equation8"}, {Step::equation9, "equation9"}, {Step::equation10, "equation10"}};
constexpr int kTile = 380;
constexpr double kFieldOfView = 0.5;

Result<void> check(const StepComparison& c) {
  if (c.times.empty() || !std::ranges::is_sorted(c.times) || !(c.times.front() > 0 && c.times.back() <= 60))
    return invalid("times", "must be one or more, ascending, in (0, 60] s");
  if (!c.alphas.empty() && c.alphas.size() != std::size(kSteps))
    return invalid("alphas", text("are ", c.alphas.size(), ", must be ", std::size(kSteps), ": of eq. 8, 9 and 10"));
  if (!(c.from.norm() > 1e-6) || !c.from.allFinite()) return invalid("from", "must be a vector of some length");
  if (!io::has_ending(c.picture, {".png"}))
    return invalid("picture", "is " + c.picture.string() + ", must end in .png");
  return {};
}

// The bodies that have values are the example-based ones; what they fall on would hide them.
Frame only_examples(Frame frame) {
  std::erase_if(frame.bodies, [](const BodyFrame& body) { return body.values.empty(); });
  return frame;
}

struct Run {
  std::vector<Topology> topologies;  // one a time
  std::vector<Frame> frames;
  json report;
};

Result<Run> run(sim::SceneDescription scene, Step step, std::optional<double> alpha, const std::vector<double>& times) {
  std::vector<std::string> names;
  for (auto& body : scene.bodies)
    if (auto* model = std::get_if<sim::ExampleModel>(&body.model)) {
      model->parameters.step = step;
      model->parameters.alpha = alpha.value_or(model->parameters.alpha);
      names.push_back(body.name);
    }
  if (names.empty()) return invalid("bodies", "has no example-based body, must have one");
  const auto world = sim::World::create(scene);
  if (!world) return std::unexpected(world.error());
  Run out;
  int steps = 0;
  for (const double time : times) {
    for (const int end = static_cast<int>(std::lround(time / scene.dt)); steps < end; ++steps) (*world)->step();
    out.topologies.push_back((*world)->topology());
    out.frames.push_back(only_examples((*world)->capture(true)));
  }
  for (const std::string& name : names) {
    const Eigen::ArrayXd moved = 1 - (*world)->example_weights((*world)->find(name)).col(0).array();
    out.report[name] = {{"weight_largest", moved.maxCoeff()}, {"weight_mean", moved.mean()}};
  }
  return out;
}

Eigen::AlignedBox3d box_of(const Frame& frame) {
  Eigen::AlignedBox3d box;
  for (const BodyFrame& body : frame.bodies)
    for (const Vec3f& p : body.positions) box.extend(p.cast<double>());
  return box;
}

}  // namespace

Result<json> compare_steps(const StepComparison& c) {
  if (auto valid = check(c); !valid) return std::unexpected(valid.error());
  const auto loaded = io::load_scene(c.scene);
  if (!loaded) return std::unexpected(loaded.error());
  std::vector<Run> runs;
  json result;
  for (const auto& [step, name] : kSteps) {
    const auto alpha = c.alphas.empty() ? std::optional<double>() : c.alphas[runs.size()];
    auto one = run(loaded->scene, step, alpha, c.times);
    if (!one) return std::unexpected(one.error());
    result[name] = one->report;
    runs.push_back(*std::move(one));
  }

  const int rows = static_cast<int>(c.times.size()), width = kTile * static_cast<int>(runs.size());
  Raster raster(width, kTile * rows, {0xf4, 0xf5, 0xf7});
  for (int row = 0; row < rows; ++row) {
    Eigen::AlignedBox3d box;
    for (const Run& r : runs) box.extend(box_of(r.frames[static_cast<std::size_t>(row)]));
    const double away = 0.5 * box.diagonal().norm() / std::tan(kFieldOfView / 2);
    const Camera camera{
        .eye = box.center() + away * c.from.normalized(), .target = box.center(), .field_of_view = kFieldOfView};
    for (std::size_t k = 0; k < runs.size(); ++k)
      raster.draw(patches(runs[k].topologies[static_cast<std::size_t>(row)],
                          runs[k].frames[static_cast<std::size_t>(row)], camera, kTile, kTile),
                  kTile * static_cast<int>(k), kTile * row, kTile, kTile);
  }
  if (auto written = io::write_file(c.picture, io::png_of(raster.rgb(), width, kTile * rows)); !written)
    return std::unexpected(written.error());
  result["picture"] = c.picture.string();
  return result;
}

}  // namespace crumple::lab
