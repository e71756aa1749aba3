#include "common/stream_decoder.h"
#include "server/lab/benchmark_scenes.h"
#include "server/lab/chart/measures.h"
#include "server/lab/chart/motion.h"
#include "server/sim/world.h"

#include <cmath>

namespace crumple::lab::chart {
namespace {

constexpr int kSteps = 20;     // of 1/60 s: the beam is well bent by then
constexpr double kFrames = 60;  // a second

Result<sim::SceneDescription> scene_of(const Setup& setup) {
  const int n = setup.cells;
  return beam_scene({.lattice = setup.lattice, .cells = {6 * n, n, n}, .size = {1, 0.16, 0.16}, .young = 1e6,
                     .damping_mass = 0, .damping_stiffness = 0});
}

}  // namespace

Measure wire() {
  return {[](const Setup& setup, Workshop&) -> Result<Sample> {
            auto scene = scene_of(setup);
            if (!scene) return std::unexpected(scene.error());
            auto made = sim::World::create(*scene, {});
            if (!made) return std::unexpected(made.error());
            const FrameReference reference = FrameReference::of_sender((*made)->topology());
            StreamDecoder reader;
            for (const std::string& message : encode((*made)->topology(), std::nullopt, setup.codec, setup.compress)) {
              if (auto taken = reader.take_topology(message); !taken) return std::unexpected(taken.error());
            }
            for (int k = 0; k < kSteps; ++k) (*made)->step();
            // What is drawn are the surface's nodes: each frame position is some node's, exact to float.
            const Frame frame = (*made)->capture();
            const double from = now_seconds();
            const std::string bytes = encode(frame, reference, setup.codec, setup.compress);
            auto back = reader.decode_frame(bytes);
            const double seconds = kFrames * (now_seconds() - from);
            if (!back) return std::unexpected(back.error());
            const std::vector<Vec3f>& sent = frame.bodies[0].positions;
            const std::vector<Vec3f>& got = back->bodies[0].positions;
            const std::vector<Vec3>& nodes = (*made)->fem(0).x;
            double difference = 0;
            for (std::size_t v = 0; v < sent.size(); ++v) {
              // The exact position is the double that was rounded to this float: the nearest node.
              double nearest = 1e300;
              Vec3 exact = sent[v].cast<double>();
              for (const Vec3& x : nodes) {
                const double d = (x - sent[v].cast<double>()).squaredNorm();
                if (d < nearest) {
                  nearest = d;
                  exact = x;
                }
              }
              difference += (got[v].cast<double>() - exact).squaredNorm();
            }
            const double rms = std::sqrt(difference / static_cast<double>(sent.size()));  // of a body 1 m long
            return Sample{{{"error", rms}, {"seconds", seconds}, {"vertices", static_cast<double>(sent.size())},
                           {"bytes_a_vertex", static_cast<double>(bytes.size()) / static_cast<double>(sent.size())}},
                          ""};
          },
          [](const Setup& setup, Workshop&) -> Result<std::uint64_t> {
            auto scene = scene_of(setup);
            if (!scene) return std::unexpected(scene.error());
            return scene_hash(*scene);
          }};
}

}  // namespace crumple::lab::chart
