#include "server/sim/example_based/application.h"

#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crumple::sim::example_based {
namespace {

constexpr int kChunk = 512;  // rows a task

// Of one row, in place. kExamples: their number where the compiler may know it, or 0.
template <int kExamples = 0>
void normalise(double* row, int count) {
  const int examples = kExamples > 0 ? kExamples : count;
  double sum = 0;
  for (int e = 0; e < examples; ++e) {
    row[e] = row[e] > 0 ? row[e] : 0;  // not a number is clamped, too
    sum += row[e];
  }
  if (sum >= kMinRowSum) {
    const double scale = 1 / sum;
    for (int e = 0; e < examples; ++e) row[e] *= scale;
  } else {
    std::fill(row, row + examples, 0);
    row[0] = 1;
  }
}

// Eqs. 13 and 14 on one row of E and dE.
struct Applied {
  bool changed;  // a bit of E
  bool done;     // nothing is left in dE
};
template <int kExamples>
Applied apply_to_row(double lambda, double negligible, int count, double* E, double* dE) {
  const int examples = kExamples > 0 ? kExamples : count;
  double next[kExamples > 0 ? kExamples : kMaxExamples];
  double left = 0;
  for (int e = 0; e < examples; ++e) {
    next[e] = E[e] + (1 - lambda) * dE[e];
    dE[e] *= lambda;
    left = std::max(left, std::abs(dE[e]));
  }
  const bool done = left <= negligible;
  if (done) {
    for (int e = 0; e < examples; ++e) next[e] += std::exchange(dE[e], 0);
  }
  normalise<kExamples>(next, examples);
  bool changed = false;
  for (int e = 0; e < examples; ++e) changed |= std::exchange(E[e], next[e]) != next[e];
  return {changed, done};
}

// Rows that are done are struck from `active`, those whose E stayed from `changed`: -1.
template <int kExamples>
void apply_to_rows(double lambda, double negligible, ExampleState& state, std::vector<int>& changed, int begin, int end) {
  const int examples = static_cast<int>(state.E.cols());
  double *E = state.E.data(), *dE = state.dE.data();
  for (int k = begin; k < end; ++k) {
    const std::ptrdiff_t at = std::ptrdiff_t{examples} * state.active[k];
    const Applied applied = apply_to_row<kExamples>(lambda, negligible, examples, E + at, dE + at);
    if (applied.done) state.active[k] = -1;
    if (!applied.changed) changed[k] = -1;
  }
}

auto rows_for(int examples) {
  switch (examples) {
    case 2: return apply_to_rows<2>;
    case 3: return apply_to_rows<3>;
    case 4: return apply_to_rows<4>;
    case 5: return apply_to_rows<5>;
    case 6: return apply_to_rows<6>;
    case 7: return apply_to_rows<7>;
    default: return apply_to_rows<0>;
  }
}

}  // namespace

double lambda_per_step(const ExampleParameters& parameters, double dt, double rate_dt) {
  return parameters.raw_rates ? parameters.lambda : std::pow(parameters.lambda, dt / rate_dt);
}

void normalise_row(WeightMatrix& E, int i) {
  normalise(E.row(i).data(), static_cast<int>(E.cols()));
}

void apply_delayed(const ExampleParameters& parameters, double lambda, const ThreadPool& pool, ExampleState& state,
                   std::vector<int>& changed) {
  const double negligible = parameters.raw_rates ? kRawNegligible : kNegligible;
  const auto apply = rows_for(static_cast<int>(state.E.cols()));
  changed.assign(state.active.begin(), state.active.end());
  pool.for_chunks(static_cast<int>(state.active.size()), kChunk,
                  [&](int begin, int end) { apply(lambda, negligible, state, changed, begin, end); });
  std::erase(state.active, -1);
  std::erase(changed, -1);
}

}  // namespace crumple::sim::example_based
