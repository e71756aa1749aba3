#include "server/sim/fracture/node_splitter.h"

#include <algorithm>
#include <cassert>

namespace crumple::sim::fracture {

namespace {

bool has(const Tet& tet, int node) { return std::ranges::find(tet, node) != tet.end(); }

}  // namespace

NodeSplitter::NodeSplitter(std::vector<Tet>& tets, fem::FemState& state, NodeStars& stars, const Toughness& toughness)
    : tets_(tets), state_(state), stars_(stars), toughness_(toughness), old_node_count_(stars.node_count()) {
  assert(static_cast<int>(state.x.size()) == stars.node_count() && state.x.size() == state.v.size());
}

Vec3 NodeSplitter::centroid(int t) const {
  const Tet& tet = tets_[t];
  return 0.25 * (state_.x[tet[0]] + state_.x[tet[1]] + state_.x[tet[2]] + state_.x[tet[3]]);
}

// Which tets of the candidate's star go to the copy.
std::vector<char> NodeSplitter::in_front(const SplitCandidate& candidate) const {
  const std::span<const int> star = stars_[candidate.node];
  const auto stays_whole = [&](int t) { return toughness_.of(t) > candidate.toughness || toughness_.never_parts(t); };
  const auto before_plane = [&](const Vec3& point) {
    return (point - state_.x[candidate.node]).dot(candidate.normal) > 0;
  };
  std::vector<char> front(star.size());
  Vec3 sum = Vec3::Zero();
  int whole = 0;
  for (std::size_t i = 0; i < star.size(); ++i) {
    const Vec3 middle = centroid(star[i]);
    front[i] = before_plane(middle);
    if (toughness_.same_everywhere() || !stays_whole(star[i])) continue;
    sum += middle;
    ++whole;
  }
  if (whole == 0) return front;
  const char side = before_plane(sum / whole);
  for (std::size_t i = 0; i < star.size(); ++i)
    if (stays_whole(star[i])) front[i] = side;
  return front;
}

void NodeSplitter::list_faces_at(int node) {
  faces_.clear();
  const std::span<const int> star = stars_[node];
  for (int i = 0; i < static_cast<int>(star.size()); ++i) {
    int others[3], count = 0;
    for (const int other : tets_[star[i]])
      if (other != node) others[count++] = other;
    std::sort(others, others + 3);
    const auto add = [&](int low, int high) {
      faces_.push_back({static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high), i});
    };
    add(others[0], others[1]);
    add(others[0], others[2]);
    add(others[1], others[2]);
  }
  std::ranges::sort(faces_, [](const FaceAtNode& a, const FaceAtNode& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.index < b.index;
  });
}

// Tets of the star that are connected through faces at the node form a group; tets that never give way are all of one.
void NodeSplitter::list_groups_at(int node) {
  list_faces_at(node);
  const int size = static_cast<int>(stars_[node].size());
  group_.resize(size);
  for (int i = 0; i < size; ++i) group_[i] = i;
  const auto root = [&](int i) {
    while (group_[i] != i) i = group_[i] = group_[group_[i]];
    return i;
  };
  for (std::size_t f = 1; f < faces_.size(); ++f) {
    if (!faces_[f].same_face(faces_[f - 1])) continue;
    const auto [low, high] = std::minmax({root(faces_[f - 1].index), root(faces_[f].index)});
    group_[high] = low;
  }
  for (int i = 0, first = -1; i < size && !toughness_.same_everywhere(); ++i) {
    if (!toughness_.never_parts(stars_[node][i])) continue;
    if (first < 0) first = i;
    const auto [low, high] = std::minmax({root(first), root(i)});
    group_[high] = low;
  }
  int count = 0;  // roots come before the rest of their group, so one pass renames both
  std::vector<char>& is_root = moves_;
  is_root.assign(size, 0);
  for (int i = 0; i < size; ++i) is_root[i] = group_[i] == i;
  for (int i = 0; i < size; ++i) group_[i] = is_root[i] ? count++ : group_[group_[i]];
}

// Whether t belongs to a piece of at least kMinFragmentTets tets; looks no further than that.
bool NodeSplitter::in_large_piece(int t) const {
  std::array<int, kMinFragmentTets> piece{t};
  int count = 1;
  for (int i = 0; i < count; ++i) {
    const Tet& tet = tets_[piece[i]];
    for (int k = 0; k < 4; ++k) {
      const int a = tet[(k + 1) % 4], b = tet[(k + 2) % 4], c = tet[(k + 3) % 4];
      for (const int other : stars_[a]) {
        if (!has(tets_[other], b) || !has(tets_[other], c)) continue;
        if (std::find(piece.begin(), piece.begin() + count, other) != piece.begin() + count) continue;
        piece[count++] = other;
        if (count == kMinFragmentTets) return true;
      }
    }
  }
  return false;
}

// Hands the tets of the star with moves[i] to a new node at the same place with the same velocity.
int NodeSplitter::replicate(int node, const std::vector<char>& moves) {
  int i = 0;
  const int copy = stars_.split(node, [&](int) { return moves[i++] != 0; });
  for (const int t : stars_[copy]) *std::ranges::find(tets_[t], node) = copy;
  const Vec3 x = state_.x[node], v = state_.v[node];  // by value: the arrays may move
  state_.x.push_back(x);
  state_.v.push_back(v);
  report_.origin.push_back(node < old_node_count_ ? node : report_.origin[node - old_node_count_]);
  return copy;
}

void NodeSplitter::merge_back(int node, int copy) {
  for (const int t : stars_[copy]) *std::ranges::find(tets_[t], copy) = node;
  stars_.undo_split(node);
  state_.x.pop_back();
  state_.v.pop_back();
  report_.origin.pop_back();
}

bool NodeSplitter::separate_joints(int node) {
  for (bool parted = false;; parted = true) {
    list_groups_at(node);
    moves_.assign(group_.size(), 0);
    bool any = false;
    for (std::size_t i = 0; i < group_.size(); ++i) any |= moves_[i] = group_[i] == 1;
    if (!any) return parted;
    parted_.push_back(replicate(node, moves_));
    ++report_.separated;
  }
}

bool NodeSplitter::split(const SplitCandidate& candidate) {
  const int node = candidate.node;
  assert(node >= 0 && node < stars_.node_count());
  const std::span<const int> star = stars_[node];
  const std::vector<char> front = in_front(candidate);
  if (std::ranges::count(front, 0) == 0 || std::ranges::count(front, 1) == 0) return false;

  list_faces_at(node);
  cut_tets_.clear();
  cut_nodes_.clear();
  for (std::size_t f = 1; f < faces_.size(); ++f) {
    const FaceAtNode &a = faces_[f - 1], &b = faces_[f];
    if (!a.same_face(b) || front[a.index] == front[b.index]) continue;
    cut_tets_.insert(cut_tets_.end(), {star[a.index], star[b.index]});
    cut_nodes_.insert(cut_nodes_.end(), {a.low(), a.high()});
  }

  const int copy = replicate(node, front);
  if (!std::ranges::all_of(cut_tets_, [&](int t) { return in_large_piece(t); })) {
    merge_back(node, copy);
    ++report_.refused;
    return false;
  }
  report_.splits.push_back({node, copy, state_.x[node], candidate.normal});

  cut_nodes_.insert(cut_nodes_.end(), {node, copy});
  std::ranges::sort(cut_nodes_);
  cut_nodes_.erase(std::unique(cut_nodes_.begin(), cut_nodes_.end()), cut_nodes_.end());
  parted_.clear();
  tips_.clear();
  for (const int cut : cut_nodes_) {
    const bool parted = separate_joints(cut) || cut == node || cut == copy;
    (parted ? parted_ : tips_).push_back(cut);
  }
  std::ranges::sort(parted_);
  return true;
}

}  // namespace crumple::sim::fracture
