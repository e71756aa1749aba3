#include "server/sim/contact/sweep_and_prune.h"

#include <algorithm>

namespace crumple::sim::contact {
namespace {

constexpr std::size_t kFewPairs = 1500;  // trying each costs less than sorting

// One end of the sweep: a box and where it starts and ends on the sweep axis.
struct Interval {
  double begin, end;
  int box;
  bool first_set;
};

bool usable(const Box3& box) {
  return (box.min().array() <= box.max().array()).all() && box.min().allFinite() && box.max().allFinite();
}

void gather_usable(std::span<const Box3> boxes, Eigen::Vector3d& low, Eigen::Vector3d& high, int& count) {
  for (const Box3& box : boxes) {
    if (!usable(box)) continue;
    low = low.cwiseMin(box.center());
    high = high.cwiseMax(box.center());
    ++count;
  }
}

void push_intervals(std::span<const Box3> boxes, int axis, bool first_set, std::vector<Interval>& intervals) {
  for (int i = 0; i < static_cast<int>(boxes.size()); ++i)
    if (usable(boxes[i])) intervals.push_back({boxes[i].min()[axis], boxes[i].max()[axis], i, first_set});
}

// Until the thread's next call.
const std::vector<Interval>& sorted_intervals(std::span<const Box3> a, std::span<const Box3> b) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  int count = 0;
  gather_usable(a, low, high, count);
  gather_usable(b, low, high, count);
  thread_local std::vector<Interval> intervals;
  intervals.clear();
  if (count == 0) return intervals;
  int axis = 0;
  (high - low).maxCoeff(&axis);
  intervals.reserve(count);
  push_intervals(a, axis, true, intervals);
  push_intervals(b, axis, false, intervals);
  std::sort(intervals.begin(), intervals.end(), [](const Interval& p, const Interval& q) {
    if (p.begin != q.begin) return p.begin < q.begin;
    return p.first_set != q.first_set ? p.first_set : p.box < q.box;
  });
  return intervals;
}

// Calls meet(earlier, later) for each two intervals that overlap.
template <class Meet>
void sweep(const std::vector<Interval>& intervals, Meet meet) {
  thread_local std::vector<int> open;  // intervals that have begun and not ended
  open.clear();
  for (int i = 0; i < static_cast<int>(intervals.size()); ++i) {
    const Interval& now = intervals[i];
    std::erase_if(open, [&](int k) { return intervals[k].end < now.begin; });
    for (const int k : open) meet(intervals[k], now);
    open.push_back(i);
  }
}

}  // namespace

std::vector<IndexPair> sweep_and_prune(std::span<const Box3> boxes) {
  std::vector<IndexPair> pairs;
  sweep_and_prune(boxes, pairs);
  return pairs;
}

void sweep_and_prune(std::span<const Box3> boxes, std::vector<IndexPair>& pairs) {
  pairs.clear();
  sweep(sorted_intervals(boxes, {}), [&](const Interval& p, const Interval& q) {
    if (boxes[p.box].intersects(boxes[q.box])) pairs.push_back(std::minmax(p.box, q.box));
  });
  std::sort(pairs.begin(), pairs.end());
}

void sweep_and_prune(std::span<const Box3> a, std::span<const Box3> b, std::vector<IndexPair>& pairs) {
  pairs.clear();
  if (a.size() * b.size() <= kFewPairs) {
    for (int i = 0; i < static_cast<int>(a.size()); ++i)
      for (int j = 0; j < static_cast<int>(b.size()); ++j)
        if (a[i].intersects(b[j]) && usable(a[i]) && usable(b[j])) pairs.emplace_back(i, j);
    return;
  }
  sweep(sorted_intervals(a, b), [&](const Interval& p, const Interval& q) {
    if (p.first_set == q.first_set) return;
    const int i = p.first_set ? p.box : q.box, j = p.first_set ? q.box : p.box;
    if (a[i].intersects(b[j])) pairs.emplace_back(i, j);
  });
  std::sort(pairs.begin(), pairs.end());
}

}  // namespace crumple::sim::contact
