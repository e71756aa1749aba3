#include "server/sim/contact/lasting_rows.h"

#include <algorithm>

namespace crumple::sim::contact {
namespace {

constexpr int kNodes = 4;  // of a tet

bool is_whole_and_free(const ContactSide& side, const CollisionBody& body) {
  if (body.origin >= 0 || body.x.empty()) return false;  // has broken; is a sleeper that nothing is near
  return body.fixed.empty() || std::ranges::none_of(side.nodes, [&](int node) { return body.fixed[node]; });
}

bool of_one_pair(const ContactRow& a, const ContactRow& b) {
  return a.sides[0].body == b.sides[0].body && a.sides[1].body == b.sides[1].body;
}

}  // namespace

void remember_pushing(std::span<const ContactRow> rows, int soft_bodies, LastingRows& memory) {
  const auto is_of_unknowns = [&](const ContactSide& side) { return side.body < soft_bodies && side.node_count == kNodes; };
  for (const ContactRow& row : rows)
    if (row.active && row.lambda_n > 0 && !row.swept && row.lasted < kLongest && std::ranges::all_of(row.sides, is_of_unknowns)) memory.push_back(row);
}

void append_lasting(const LastingRows& memory, std::span<const CollisionBody> bodies, double dt, std::vector<RowKey>& keys,
                    std::vector<ContactRow>& rows) {
  if (memory.empty()) return;
  keys.clear();
  for (const ContactRow& row : rows) keys.push_back(row.key());
  std::ranges::sort(keys);
  const std::size_t found = rows.size();
  int pair = found == 0 ? -1 : rows.back().pair;
  for (const ContactRow& last : memory) {
    const auto goes_on = [&](const ContactSide& side) { return is_whole_and_free(side, bodies[side.body]); };
    if (std::ranges::binary_search(keys, last.key()) || !std::ranges::all_of(last.sides, goes_on)) continue;
    if (rows.size() == found || !of_one_pair(rows.back(), last)) ++pair;
    ContactRow& row = rows.emplace_back(last);
    const double speed = last.target - last.lambda_n / last.c_n;  // n . u of the last step's outcome
    row.depth = std::min(0.0, last.depth - dt * speed);
    row.target = row.depth / dt;
    row.pair = pair;
    ++row.lasted;
  }
}

}  // namespace crumple::sim::contact
