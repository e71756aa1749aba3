#include "server/sim/fracture/crack_growth.h"

#include "server/sim/fem/tensile_part.h"

#include <algorithm>
#include <optional>
#include <queue>
#include <utility>

namespace crumple::sim::fracture {

namespace {

// Nodes over their toughness, the most overloaded first.
class CandidateQueue {
 public:
  // Takes the place of what is known of the node.
  void renew(const SplitCandidate& candidate) {
    if (candidate.node >= static_cast<int>(renewals_.size())) renewals_.resize(candidate.node + 1, 0);
    const int renewal = ++renewals_[candidate.node];
    if (candidate.breaks()) queue_.push({candidate.strength / candidate.toughness, renewal, candidate});
  }

  std::optional<SplitCandidate> pop() {
    while (!queue_.empty()) {
      const Entry top = queue_.top();
      queue_.pop();
      if (top.renewal == renewals_[top.candidate.node]) return top.candidate;
    }
    return {};
  }

 private:
  struct Entry {
    double overload;  // strength over toughness
    int renewal;      // of the node; there may be a later one
    SplitCandidate candidate;
    bool operator<(const Entry& other) const {
      return std::pair(overload, -candidate.node) < std::pair(other.overload, -other.candidate.node);
    }
  };
  std::priority_queue<Entry> queue_;
  std::vector<int> renewals_;  // one a node
};

void sort_unique(std::vector<int>& ids) {
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

class CrackGrowth {
 public:
  CrackGrowth(std::vector<Tet>& tets, NodeStars& stars, const Toughness& toughness, std::span<const Mat34> normals,
              std::span<Mat3> stress, PartForces& forces)
      : tets_(tets), stars_(stars), toughness_(toughness), normals_(normals), stress_(stress), forces_(forces) {}

  // Hands on what `candidate`, just split, bore; the queue knows it all anew.
  void follow(const SplitCandidate& candidate, const NodeSplitter& splitter, CandidateQueue& queue);

 private:
  void relieve(const NodeSplit& split, double toughness);
  Mat3 tensor(int node) const { return separation_tensor(node, tets_, stars_, forces_); }

  std::vector<Tet>& tets_;
  NodeStars& stars_;
  const Toughness& toughness_;
  std::span<const Mat34> normals_;
  std::span<Mat3> stress_;
  PartForces& forces_;
  std::vector<Mat3> residual_;  // one a node [N]; zero where there is no crack's end
  std::vector<int> affected_;   // nodes of the tets around the last split
};

void CrackGrowth::relieve(const NodeSplit& split, double toughness) {
  const Mat3 P = Mat3::Identity() - split.normal * split.normal.transpose();
  affected_.clear();
  for (const int node : {split.node, split.copy}) {
    for (const int t : stars_[node]) {
      affected_.insert(affected_.end(), tets_[t].begin(), tets_[t].end());
      if (toughness_.of(t) > toughness) continue;
      const Mat3 tensile = fem::tensile_part(stress_[t]);
      stress_[t] += P * tensile * P - tensile;
      set_part_forces(t, stress_[t], normals_[t], forces_);
    }
  }
}

void CrackGrowth::follow(const SplitCandidate& candidate, const NodeSplitter& splitter, CandidateQueue& queue) {
  const std::span<const int> tips = splitter.tips(), parted = splitter.parted();
  residual_.resize(stars_.node_count(), Mat3::Zero());
  for (const int tip : tips) residual_[tip] += tensor(tip);
  relieve(splitter.last(), candidate.toughness);
  const Mat3 excess =
      (candidate.strength - candidate.toughness) * candidate.area * candidate.normal * candidate.normal.transpose();
  for (const int tip : tips) residual_[tip] += excess / static_cast<double>(tips.size()) - tensor(tip);
  for (const int node : parted) residual_[node].setZero();

  affected_.insert(affected_.end(), parted.begin(), parted.end());
  sort_unique(affected_);
  for (const int node : affected_)
    queue.renew(split_candidate(node, tets_, stars_, normals_, forces_, toughness_, residual_[node]));
}

}  // namespace

SplitReport grow_cracks(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars,
                        std::span<const SplitCandidate> candidates, const Toughness& toughness,
                        std::span<const Mat34> normals, int max_splits, std::span<Mat3> stress, PartForces& forces) {
  NodeSplitter splitter(tets, state, stars, toughness);
  CrackGrowth growth(tets, stars, toughness, normals, stress, forces);
  CandidateQueue queue;
  for (const SplitCandidate& candidate : candidates) queue.renew(candidate);
  while (splitter.split_count() < max_splits) {
    const std::optional<SplitCandidate> candidate = queue.pop();
    if (!candidate) break;
    if (splitter.split(*candidate)) growth.follow(*candidate, splitter, queue);
  }
  return splitter.report();
}

}  // namespace crumple::sim::fracture
