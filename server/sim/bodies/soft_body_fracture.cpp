#include "server/sim/bodies/soft_body.h"

#include "server/sim/scatter.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crumple::sim {

std::vector<int> SoftBody::follow_topology() {
  system.elements.macros = {};  // of others
  return fem::follow_topology(rest, tets, node_count());
}

bool SoftBody::may_break(std::uint64_t step) const {
  return !frozen && !is_empty() && rest.breakable() && step % material().fracture_interval == 0;
}

// Parker & O'Brien 2009, section 5, at state.x, where the elements are up to date.
SoftBody::Parted SoftBody::split_nodes(std::uint64_t seed, std::uint64_t step, const ThreadPool& pool,
                                       FractureOutcome& outcome) {
  const fracture::SplitReport report =
      fracture::fracture_step(rest, system.elements, piece_seed(seed, id, piece), step, pool, tets, state, stars_, fracture_scratch_);
  outcome = {};
  if (report.splits.empty()) return {};

  restart();
  fracture::extend_by_origin(X, report.origin);
  fracture::extend_by_origin(fixed, report.origin);
  const int first_copy = node_count() - static_cast<int>(report.origin.size());
  changed_while_prescribed_ = true;
  const auto copies_of = [&](int node, const auto& add) {
    for (std::size_t k = 0; k < report.origin.size(); ++k) {
      if (report.origin[k] == node) add(first_copy + static_cast<int>(k));
    }
  };
  for (DrivenNodes& driven : driven_) {
    for (std::size_t at = 0, count = driven.motion.nodes.size(); at < count; ++at) {
      copies_of(driven.motion.nodes[at], [&](int copy) {
        driven.motion.nodes.push_back(copy);
        driven.at_start.push_back(driven.at_start[at]);
      });
    }
  }
  for (std::size_t at = 0, count = prescribed_.size(); at < count; ++at) {
    const Vec3 velocity = prescribed_[at].velocity;
    copies_of(prescribed_[at].node, [&](int copy) { prescribed_.push_back({copy, velocity}); });
  }
  if (command_force_.size() > 0) command_force_.conservativeResizeLike(Eigen::VectorXd::Zero(3 * node_count()));
  std::vector<int> element_before = follow_topology();
  if (rest.grouped()) state.plastic_strain = fem::inherited(state.plastic_strain, element_before);
  follow_tets();
  whole_ = false;
  may_part_ = true;
  outcome = {.splits = static_cast<int>(report.splits.size()), .point = report.splits.front().point};
  return {report.origin, std::move(element_before)};
}

FractureOutcome SoftBody::fracture(std::uint64_t seed, std::uint64_t step, const ThreadPool& pool) {
  FractureOutcome outcome;
  const bool whole = std::exchange(whole_ahead_, false);
  if (!may_break(step) || whole) return outcome;
  // Where something yields the flow has left the elements at these positions already.
  if (!rest.yields()) fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
  elements_at_state_ = true;
  split_nodes(seed, step, pool, outcome);
  return outcome;
}

FractureOutcome SoftBody::fracture_ahead(Eigen::VectorXd& v_ahead, double dt, double creep_dt,
                                         std::uint64_t seed, std::uint64_t step, int round, const ThreadPool& pool) {
  FractureOutcome outcome;
  if (!may_break(step) || !v_ahead.allFinite()) return outcome;
  x_kept_ = state.x;
  v_kept_ = state.v;
  for (int n = 0; n < node_count(); ++n) state.x[n] += dt * v_ahead.segment<3>(3 * n);
  // What yields in this step does not tear in it: stress is looked at after the flow, as at the end of a step.
  std::vector<Mat3>& plastic_strain = plastic_strain_kept_;
  if (rest.yields()) {
    plastic_strain = state.plastic_strain;
    fem::plastic_flow(rest, tets, state.x, dt, creep_dt, pool, state.plastic_strain, system.elements);
  } else {
    fem::update_elements(rest, tets, state.x, state.plastic_strain, pool, system.elements);
  }
  const auto [origin, element_before] = split_nodes(seed + static_cast<std::uint64_t>(round), step, pool, outcome);
  fracture::extend_by_origin(x_kept_, origin);
  fracture::extend_by_origin(v_kept_, origin);
  const Eigen::Index known = v_ahead.size() / 3;
  if (!origin.empty()) v_ahead.conservativeResize(3 * node_count());
  for (std::size_t k = 0; k < origin.size(); ++k)
    v_ahead.segment<3>(3 * (known + static_cast<Eigen::Index>(k))) = v_ahead.segment<3>(3 * origin[k]);
  state.x.swap(x_kept_);
  state.v.swap(v_kept_);
  if (rest.yields()) {
    if (rest.grouped() && outcome.splits > 0) plastic_strain = fem::inherited(plastic_strain, element_before);
    state.plastic_strain.swap(plastic_strain);
  }
  whole_ahead_ = outcome.splits == 0;
  return outcome;
}

}  // namespace crumple::sim
