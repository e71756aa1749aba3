#include "server/sim/example_based/secondary_goal.h"

#include "server/sim/example_based/application.h"
#include "server/sim/example_based/simplex_tangent.h"
#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace crumple::sim::example_based {
namespace {

using Goal = ExampleParameters::SecondaryGoal;

constexpr int kChunk = 16;             // rows a task
constexpr double kExact = 1e-12;       // of the body's size: the least tolerance, what rounding leaves
constexpr double kStill = 1e-9;        // a change of weights below this is none
constexpr double kEnded = 1e-6;        // a weight below this is not taken further down, but to 0
constexpr double kSmoothing = 0.9;     // of the way to the neighbours' mean: rows that are moved side by side cannot overshoot
constexpr int kHalvings = 5;
constexpr int kNewton = 4;

// One row, and the place its vertex must keep.
class Row {
 public:
  Row(const ExampleRest& rest, int vertex, const Vec3& x, double tolerance, const WeightRow& E)
      : rest_(rest), vertex_(vertex), x_(x), tolerance_(tolerance), E_(E) {}
  const WeightRow& weights() const { return E_; }

  bool prefer_few() {
    bool changed = false;
    for (int round = 0; round < 2 * E_.size() + 2; ++round) {
      const ExampleList used = support(E_);
      if (used.size() <= 1) break;
      const SimplexTangent tangent = at(E_, used);
      WeightRow d = tangent.still_part(E_);
      // Weights in balance, as those of an example that is there twice: the first of them.
      for (int k = 0; k < used.size() && !(d.cwiseAbs().maxCoeff() > kStill); ++k)
        d = tangent.still_part(WeightRow::Unit(E_.size(), used[k]));
      if (!(d.cwiseAbs().maxCoeff() > kStill) || !go(d, std::numeric_limits<double>::infinity())) break;
      changed = true;
    }
    return changed;
  }

  bool approach(const WeightRow& target) {
    const WeightRow wanted = target - E_;
    ExampleList free(E_.size());
    for (int e = 0; e < E_.size(); ++e) free[e] = e;
    // Examples that have nothing to give are left out, one round after the other.
    for (;;) {
      if (free.size() <= 1) return false;
      const WeightRow d = at(E_, free).still_part(wanted);
      ExampleList kept(0);
      for (const int e : free)
        if (E_[e] > kEnded || d[e] >= 0) append(kept, e);
      if (kept.size() == free.size()) return d.cwiseAbs().maxCoeff() > kStill && go(d, kSmoothing);
      free = kept;
    }
  }

 private:
  static void append(ExampleList& list, int e) {
    list.conservativeResize(list.size() + 1);
    list[list.size() - 1] = e;
  }

  static ExampleList support(const WeightRow& row) {
    ExampleList used(0);
    for (int e = 0; e < row.size(); ++e)
      if (row[e] > 0) append(used, e);
    return used;
  }

  SimplexTangent at(const WeightRow& row, const ExampleList& examples) const {
    return SimplexTangent(skinning_jacobian(rest_, vertex_, row), examples, tolerance_ / 2);
  }

  // Along d by at most `most`, no further than where a weight ends, and back onto the vertex' place.
  bool go(const WeightRow& d, double most) {
    int ended = -1;
    double t = most;
    for (int e = 0; e < E_.size(); ++e)
      if (d[e] < 0 && E_[e] < -d[e] * t) t = E_[e] / -d[e], ended = e;
    if (!std::isfinite(t)) return false;
    for (int k = 0; k <= kHalvings; ++k, t /= 2) {
      WeightRow next = E_ + t * d;
      if (k == 0 && ended >= 0) next[ended] = 0;
      if (put_back(next)) {
        E_ = next;
        return true;
      }
    }
    return false;
  }

  // Only with weights that are there: what ended stays so.
  bool put_back(WeightRow& row) const {
    for (int k = 0;; ++k) {
      row = row.cwiseMax(0);
      row /= row.sum();
      const Vec3 off = x_ - skin_vertex(rest_, vertex_, row);
      if (off.norm() <= tolerance_) return true;
      if (k == kNewton || rest_.linear) return false;
      row += at(row, support(row)).reaching(off);
      if (row.minCoeff() < -kEnded) return false;
    }
  }

  const ExampleRest& rest_;
  int vertex_;
  Vec3 x_;
  double tolerance_;  // [m]
  WeightRow E_;
};

WeightRow neighbours_mean(const ExampleRest& rest, const WeightMatrix& E, int i) {
  WeightRow sum = WeightRow::Zero(E.cols());
  double weights = 0;
  for (int k = rest.graph.start[i]; k < rest.graph.start[i + 1]; ++k) {
    const double w = 1 / rest.graph.length[k];
    sum += w * E.row(rest.graph.neighbour[k]).transpose();
    weights += w;
  }
  return weights > 0 ? WeightRow(sum / weights) : WeightRow(E.row(i).transpose());
}

}  // namespace

void leave_goal(ExampleState& state) {
  state.goal_rows.clear();
  state.goal_x.clear();
  state.goal_left = 0;
}

void begin_goal(const ExampleParameters& parameters, ExampleState& state) {
  leave_goal(state);
  if (parameters.secondary_goal == Goal::none) return;
  for (int i = 0; i < state.E.rows(); ++i) {
    if (state.E(i, 0) >= 1) continue;
    state.goal_rows.push_back(i);
    state.goal_x.push_back(state.x[i]);
  }
  const int passes = parameters.secondary_goal == Goal::smooth_weights ? kSmoothPasses : 1;
  state.goal_left = static_cast<std::int64_t>(passes) * static_cast<std::int64_t>(state.goal_rows.size());
}

void pursue_goal(const ExampleRest& rest, const ExampleParameters& parameters, const ThreadPool& pool, ExampleState& state,
                 std::vector<int>& changed) {
  changed.clear();
  if (parameters.secondary_goal == Goal::none) leave_goal(state);
  if (state.goal_left == 0) return;
  const double tolerance = std::max(parameters.goal_tolerance, kExact) * rest.size;
  const auto rows = static_cast<std::int64_t>(state.goal_rows.size());
  // Not over the end of a pass: no row comes twice.
  const std::int64_t end_of_pass = (state.goal_left - 1) % rows + 1;
  const auto first = static_cast<int>(rows - end_of_pass);
  const auto count = static_cast<int>(std::min<std::int64_t>(kGoalRows, end_of_pass));
  std::vector<std::optional<WeightRow>> next(count);  // all from the weights as they are now
  pool.for_chunks(count, kChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = state.goal_rows[first + k];
      Row row(rest, i, state.goal_x[first + k], tolerance, state.E.row(i).transpose());
      const bool moved = parameters.secondary_goal == Goal::few_examples ? row.prefer_few() : row.approach(neighbours_mean(rest, state.E, i));
      if (moved) next[k] = row.weights();
    }
  });
  for (int k = 0; k < count; ++k) {
    if (!next[k]) continue;
    const int i = state.goal_rows[first + k];
    state.E.row(i) = next[k]->transpose();
    normalise_row(state.E, i);
    changed.push_back(i);
  }
  state.goal_left -= count;
  if (state.goal_left == 0) leave_goal(state);
}

}  // namespace crumple::sim::example_based
