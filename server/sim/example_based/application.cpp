#include "server/sim/example_based/application.h"

#include "server/sim/example_based/skinning.h"

#include <cmath>

namespace crumple::sim::example_based {
namespace {

constexpr int kChunk = 512;  // rows a task

}  // namespace

double lambda_per_step(const ExampleParameters& parameters, double dt, double rate_dt) {
  return parameters.raw_rates ? parameters.lambda : std::pow(parameters.lambda, dt / rate_dt);
}

void normalise_row(Eigen::MatrixXd& E, int i) {
  double sum = 0;
  for (int e = 0; e < E.cols(); ++e) {
    if (!(E(i, e) > 0)) E(i, e) = 0;
    sum += E(i, e);
  }
  if (sum >= kMinRowSum) {
    for (int e = 0; e < E.cols(); ++e) E(i, e) /= sum;
  } else {
    E.row(i).setZero();
    E(i, 0) = 1;
  }
}

void apply_delayed(const ExampleParameters& parameters, double lambda, const ThreadPool& pool, ExampleState& state,
                   std::vector<int>& changed) {
  const double negligible = parameters.raw_rates ? kRawNegligible : kNegligible;
  Eigen::MatrixXd& E = state.E;
  Eigen::MatrixXd& dE = state.dE;
  const int rows = static_cast<int>(state.active.size());
  changed.assign(state.active.begin(), state.active.end());
  pool.for_chunks(rows, kChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = state.active[k];
      const WeightRow before = E.row(i).transpose();
      E.row(i) += (1 - lambda) * dE.row(i);
      dE.row(i) *= lambda;
      if (dE.row(i).cwiseAbs().maxCoeff() <= negligible) {
        E.row(i) += dE.row(i);
        dE.row(i).setZero();
        state.active[k] = -1;
      }
      normalise_row(E, i);
      if (before == E.row(i).transpose()) changed[k] = -1;
    }
  });
  std::erase(state.active, -1);
  std::erase(changed, -1);
}

}  // namespace crumple::sim::example_based
