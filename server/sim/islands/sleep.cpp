#include "server/sim/islands/sleep.h"

#include "server/sim/mesh/disjoint_sets.h"

#include <algorithm>
#include <numeric>

namespace crumple::sim::islands {
void SleepingIslands::set_kinematic(int body) {
  if (sleeps(body)) --asleep_;
  activity_[body] = Activity::kinematic;
}

void SleepingIslands::put_to_sleep(int body) {
  if (activity_[body] != Activity::live) return;
  activity_[body] = Activity::asleep;
  ++asleep_;
}

void SleepingIslands::touch(int a, int b) {
  if (a != b) touches_.push_back({std::min(a, b), std::max(a, b), 0});
}

void SleepingIslands::remember(int memory) {
  std::sort(touches_.begin(), touches_.end());
  const auto same = [](const Contact& p, const Contact& q) { return p.a == q.a && p.b == q.b; };
  touches_.erase(std::unique(touches_.begin(), touches_.end(), same), touches_.end());
  for (Contact& contact : contacts_)
    if (!sleeps(contact.a) && !sleeps(contact.b)) ++contact.age;
  std::erase_if(contacts_, [&](const Contact& contact) {
    return contact.age > memory || std::binary_search(touches_.begin(), touches_.end(), contact);
  });
  contacts_.insert(contacts_.end(), touches_.begin(), touches_.end());
  std::sort(contacts_.begin(), contacts_.end());  // a pair is there once
  touches_.clear();
}

std::vector<int> SleepingIslands::settle(std::span<const char> still, int memory) {
  remember(memory);
  const int count = static_cast<int>(activity_.size());
  const auto live = [&](int body) { return activity_[body] == Activity::live; };
  std::vector<int>& parent = parent_;
  parent.resize(count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const Contact& contact : contacts_) {
    if (!live(contact.a) || !live(contact.b)) continue;
    unite(parent, contact.a, contact.b);
  }
  std::vector<char>& moves = moves_;  // by root
  moves.assign(count, 0);
  for (int body = 0; body < count; ++body)
    if (live(body) && !still[body]) moves[find_root(parent, body)] = 1;
  std::vector<int> fell;
  for (int body = 0; body < count; ++body)
    if (live(body) && !moves[find_root(parent, body)]) fell.push_back(body);
  for (const int body : fell) put_to_sleep(body);
  return fell;
}

std::vector<int> SleepingIslands::wake(int body) {
  if (!sleeps(body)) return {};
  std::vector<char> woke(activity_.size(), 0);
  std::vector<int> woken;
  const auto rouse = [&](int other) {
    activity_[other] = Activity::live;
    --asleep_;
    woke[other] = 1;
    woken.push_back(other);
  };
  rouse(body);
  // Each pass goes through all contacts that are remembered: waking is rare.
  for (std::size_t before = 0; before < woken.size();) {
    before = woken.size();
    for (const auto& [a, b, age] : contacts_) {
      if (woke[a] && sleeps(b)) rouse(b);
      if (woke[b] && sleeps(a)) rouse(a);
    }
  }
  std::sort(woken.begin(), woken.end());
  return woken;
}

std::vector<int> SleepingIslands::wake_neighbours(int body) {
  std::vector<int> neighbours, woken;
  for (const auto& [a, b, age] : contacts_) {
    if (a == body && sleeps(b)) neighbours.push_back(b);
    if (b == body && sleeps(a)) neighbours.push_back(a);
  }
  for (const int neighbour : neighbours) {
    const std::vector<int> more = wake(neighbour);
    woken.insert(woken.end(), more.begin(), more.end());
  }
  std::sort(woken.begin(), woken.end());
  return woken;
}

bool SleepingIslands::touched(int a, int b) const {
  return std::binary_search(contacts_.begin(), contacts_.end(), Contact{std::min(a, b), std::max(a, b), 0});
}

void SleepingIslands::hash(StateHash& hash) const {
  for (const Activity activity : activity_) hash.add(static_cast<std::uint64_t>(activity));
  for (const Contact& contact : contacts_) {
    for (const int value : {contact.a, contact.b, contact.age}) hash.add(static_cast<std::uint64_t>(value));
  }
}

}  // namespace crumple::sim::islands
