#include "server/sim/example_based/propagation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace crumple::sim::example_based {

double cubic_kernel(double x) { return x < 1 ? (2 * x - 3) * x * x + 1 : 0; }

void PropagationCache::clear(int vertices) {
  range_.assign(vertices, {});
  marked_.assign(vertices, 0);
  entries_.clear();
}

void PropagationCache::prepare(const ExampleRest& rest, double gamma, std::span<const WeightChange> sites,
                               const ThreadPool& pool) {
  if (gamma != gamma_ || static_cast<int>(range_.size()) != rest.vertex_count() || entries_.size() > kMaxEntries) {
    clear(rest.vertex_count());
    gamma_ = gamma;
  }
  missing_.clear();
  for (const WeightChange& site : sites)
    if (range_[site.vertex].begin < 0) missing_.push_back(site.vertex);
  std::sort(missing_.begin(), missing_.end());
  missing_.erase(std::unique(missing_.begin(), missing_.end()), missing_.end());
  if (missing_.empty()) return;

  const int count = static_cast<int>(missing_.size());
  const int chunk = (count + kSearches - 1) / kSearches;
  if (static_cast<int>(found_.size()) < count) found_.resize(count);
  pool.for_chunks(count, chunk, [&](int begin, int end) {
    for (int m = begin; m < end; ++m) {
      found_[m].clear();
      for (const Reached& r : search_[begin / chunk].run(rest.graph, missing_[m], gamma))
        if (const double phi = cubic_kernel(r.distance / gamma); phi > 0) found_[m].push_back({r.vertex, phi});
    }
  });
  for (int m = 0; m < count; ++m) {
    range_[missing_[m]] = {static_cast<int>(entries_.size()), static_cast<int>(found_[m].size())};
    entries_.insert(entries_.end(), found_[m].begin(), found_[m].end());
  }
}

std::span<const Influence> PropagationCache::influences(int site) const {
  assert(range_[site].begin >= 0);
  return std::span(entries_).subspan(range_[site].begin, range_[site].count);
}

void PropagationCache::add_reached(std::span<const WeightChange> sites, std::vector<int>& active) {
  const auto before = static_cast<std::ptrdiff_t>(active.size());
  for (int i : active) marked_[i] = 1;
  for (const WeightChange& site : sites)
    for (const Influence& reached : influences(site.vertex))
      if (!std::exchange(marked_[reached.vertex], 1)) active.push_back(reached.vertex);
  for (int i : active) marked_[i] = 0;
  // What one site reaches is ascending already.
  if (!std::is_sorted(active.begin() + before, active.end())) std::sort(active.begin() + before, active.end());
  std::inplace_merge(active.begin(), active.begin() + before, active.end());
}

void propagate(const ExampleRest& rest, const ExampleParameters& parameters, std::span<const WeightChange> changes,
               const ThreadPool& pool, PropagationCache& cache, WeightMatrix& dE, std::vector<int>& active) {
  if (changes.empty()) return;
  cache.prepare(rest, parameters.gamma, changes, pool);

  // In the order of the impulses: sums do not depend on the threads that look after other bodies.
  const int examples = static_cast<int>(dE.cols());
  for (const WeightChange& change : changes)
    for (const auto& [vertex, phi] : cache.influences(change.vertex)) {
      double* row = dE.row(vertex).data();
      for (int e = 0; e < examples; ++e) row[e] += phi * change.de[e];
    }

  cache.add_reached(changes, active);
  if (parameters.raw_rates) return;
  for (int i : active) {
    const double squared = dE.row(i).squaredNorm();
    if (squared > kMaxAccumulated * kMaxAccumulated) dE.row(i) *= kMaxAccumulated / std::sqrt(squared);
  }
}

}  // namespace crumple::sim::example_based
