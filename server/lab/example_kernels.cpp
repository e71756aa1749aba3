#include "server/lab/example_kernels.h"

#include "common/text.h"
#include "server/authoring/car_asset.h"
#include "server/lab/clock.h"
#include "server/lab/median.h"
#include "server/sim/example_based/deform.h"
#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace crumple::lab {
namespace {

namespace eb = sim::example_based;

// Every row anywhere in the simplex: no example is left out.
void scatter(eb::WeightMatrix& E, std::mt19937_64& random) {
  std::exponential_distribution<double> share;
  for (Eigen::Index i = 0; i < E.rows(); ++i) {
    for (Eigen::Index e = 0; e < E.cols(); ++e) E(i, e) = share(random);
    E.row(i) /= E.row(i).sum();
  }
}

double skinning_us(const eb::ExampleRest& rest, const ExampleKernelOptions& options, const sim::ThreadPool& pool) {
  std::mt19937_64 random(1);
  eb::ExampleState state = eb::make_state(rest, {});
  std::vector<int> all(rest.vertex_count());
  std::iota(all.begin(), all.end(), 0);
  std::vector<double> us;
  for (int k = 0; k < options.repeats; ++k) {
    scatter(state.E, random);
    const double start = now_ms();
    eb::skin(rest, state.E, all, pool, state.x);
    us.push_back(1000 * (now_ms() - start));
  }
  return median(std::move(us));
}

Json impulse_us(const eb::ExampleRest& rest, double gamma, const ExampleKernelOptions& options, const sim::ThreadPool& pool) {
  const eb::ExampleParameters parameters{.alpha = 50, .beta = 1, .gamma = gamma};
  const double mass = 1000;
  std::mt19937_64 random(2);
  std::uniform_int_distribution<std::size_t> any(0, rest.surface_vertices.size() - 1);
  eb::ExampleState state = eb::make_state(rest, parameters);
  scatter(state.E, random);
  eb::ExampleWorkspace work;
  work.now_ms = now_ms;
  std::vector<double> projection, propagation, both, first;
  std::size_t reached = 0;
  for (int k = 0; k < options.repeats; ++k) {
    const eb::VertexImpulse at{rest.surface_vertices[any(random)], Vec3(-300, 40, 25)};
    for (const bool known : {false, true}) {
      if (!known) work.cache = {};
      state.dE.setZero();
      state.active.clear();
      const double start = now_ms();
      eb::accumulate(rest, parameters, {}, mass, {&at, 1}, pool, state, work);
      (known ? both : first).push_back(1000 * (now_ms() - start));
      if (!known) continue;
      projection.push_back(1000 * work.times.projection);
      propagation.push_back(1000 * work.times.propagation);
      reached += state.active.size();
    }
  }
  return {{"vertices_reached", static_cast<double>(reached) / options.repeats}, {"projection", median(projection)},
          {"propagation", median(propagation)}, {"both", median(both)}, {"both_first_time", median(first)}};
}

}  // namespace

Result<Json> time_example_kernels(const ExampleKernelOptions& options) {
  if (!(options.cell_size >= 0.08 && options.cell_size <= 1)) return invalid("cell_size", text("is ", options.cell_size, ", must be in [0.08, 1]"));
  if (options.repeats < 1 || options.repeats > 100'000) return invalid("repeats", text("is ", options.repeats, ", must be in [1, 100000]"));
  auto set = authoring::make_car_asset({.cell_size = options.cell_size});
  if (!set) return std::unexpected(set.error());
  const auto shared = std::make_shared<const eb::ExampleSet>(std::move(*set));
  const eb::ExampleRest rest = eb::make_rest(shared);
  const sim::ThreadPool pool(options.threads);
  Json result{{"vertices", rest.vertex_count()}, {"tets", shared->mesh.tet_count()}, {"handles", shared->W.cols()},
              {"examples", shared->examples.size()}, {"skinning_us", skinning_us(rest, options, pool)}};
  for (const double gamma : {0.5, 3.33}) result["impulse_us"][Json(gamma).dump()] = impulse_us(rest, gamma, options, pool);
  return result;
}

}  // namespace crumple::lab
