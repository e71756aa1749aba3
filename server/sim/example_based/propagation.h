#pragma once

#include "server/sim/example_based/example_rest.h"
#include "server/sim/example_based/skinning.h"
#include "server/sim/parallel_for.h"

#include <cstdint>
#include <span>
#include <vector>

// Spreading a change of example weights over the body: Jones et al. 2016, section 3.2.2, eqs. 11 and 12.
namespace crumple::sim::example_based {

// phi(x) = 2 x^3 - 3 x^2 + 1 for x < 1, else 0; eq. 12, x >= 0.
double cubic_kernel(double x);

// A row of the accumulator longer than this is cut back to it, unless raw_rates. Applied step by step under clamping
// and normalising, dE = d (a push towards one example) leaves 1 - exp(-d) of that example's way: all but 1e-7 at 16.
// More changes nothing to be seen, but would hold the body in that example against whatever strikes it later.
inline constexpr double kMaxAccumulated = 16;

struct WeightChange {
  int vertex;    // i, where the impulse acted
  WeightRow de;  // de_i
};

struct Influence {
  int vertex;
  double phi;  // phi(distance / gamma), > 0
};

// The vertices within gamma of each site that was struck, kept from step to step: bodies are struck where they were
// struck before. Derived from constant data only, so it is no part of the state. Bounded: emptied when it outgrows
// kMaxEntries (8 MB a body).
class PropagationCache {
 public:
  static constexpr std::size_t kMaxEntries = 1 << 19;

  // Makes sure that `sites` are here, missing ones searched in parallel. Empties itself first where gamma is another.
  void prepare(const ExampleRest& rest, double gamma, std::span<const WeightChange> sites, const ThreadPool& pool);
  std::span<const Influence> influences(int site) const;  // ascending by vertex; `site` was prepared

  // Adds to `active` (ascending) the vertices that the sites influence. Ascending again.
  void add_reached(std::span<const WeightChange> sites, std::vector<int>& active);

 private:
  struct Range {
    int begin = -1, count = 0;
  };
  static constexpr int kSearches = 8;  // tasks at most; each owns its scratch
  void clear(int vertices);

  double gamma_ = 0;
  std::vector<Range> range_;  // N
  std::vector<Influence> entries_;
  std::vector<int> missing_;
  std::vector<std::uint8_t> marked_;  // N, all 0 between calls
  std::vector<std::vector<Influence>> found_;
  GeodesicSearch search_[kSearches];
};

// dE_j += phi(dist(i, j) / gamma) de_i for every change i and every vertex j nearer than gamma; eq. 11 with the
// distance of geodesic_distance.h in place of |x_j - x_i|. dE: N x E. `active`: ascending, what it reached is added.
void propagate(const ExampleRest& rest, const ExampleParameters& parameters, std::span<const WeightChange> changes,
               const ThreadPool& pool, PropagationCache& cache, WeightMatrix& dE, std::vector<int>& active);

}  // namespace crumple::sim::example_based
