#include "server/sim/contact/lasting_rows.h"

#include <algorithm>

namespace crumple::sim::contact {
namespace {

constexpr int kNodes = 4;  // of a tet

bool is_whole_and_free(const ContactSide& side, const CollisionBody& body) {
  if (body.origin >= 0 || body.x.empty()) return false;  // has broken; is a sleeper that nothing is near
  return body.fixed.empty() || std::ranges::none_of(side.nodes, [&](int node) { return body.fixed[node]; });
}

// From the row's point on side 1 to that on side 0, which were one where contact was looked for [m].
Vec3 apart(const ContactRow& row, std::span<const CollisionBody> bodies) {
  Vec3 way = Vec3::Zero();
  for (const ContactSide& side : row.sides)
    for (int k = 0; k < kNodes; ++k) way += side.weights[k] * bodies[side.body].x[side.nodes[k]];
  return way;
}

// By more than it is wide.
bool has_slid_off(const ContactRow& row, std::span<const CollisionBody> bodies) {
  const Vec3 way = apart(row, bodies);
  return (way - row.normal.dot(way) * row.normal).squaredNorm() > row.area;
}

}  // namespace

void LastingRows::hash(StateHash& hash) const {
  for (const ContactRow& row : rows) {
    for (const ContactSide& side : row.sides) {
      hash.add(static_cast<std::uint64_t>(side.body));
      hash.add(static_cast<std::uint64_t>(side.tet));
      for (int k = 0; k < kNodes; ++k) hash.add(static_cast<std::uint64_t>(side.nodes[k])), hash.add(side.weights[k]);
    }
    hash.add(static_cast<std::uint64_t>(row.lasted));
    hash.add(row.normal);
    for (const double value : {row.area, row.volume, row.mass, row.depth, row.target, row.c_n, row.lambda_n}) hash.add(value);
  }
}

void remember_pushing(std::span<const ContactRow> rows, int soft_bodies, double dt, LastingRows& memory) {
  const auto is_of_unknowns = [&](const ContactSide& side) { return side.body < soft_bodies && side.node_count == kNodes; };
  const auto pushed = [](const ContactRow& row) { return row.active && row.lambda_n > 0 && !row.swept; };
  for (const ContactRow& row : rows) {
    if (!pushed(row) || row.lasted == kLastingSteps || !std::ranges::all_of(row.sides, is_of_unknowns)) continue;
    memory.rows.push_back(row);
    memory.rows.back().depth -= dt * (row.target - row.lambda_n / row.c_n);  // n . u
  }
}

void append_lasting(const LastingRows& memory, std::span<const CollisionBody> bodies, double dt, RowIndex& found,
                    std::vector<ContactRow>& rows) {
  if (memory.rows.empty()) return;
  found.assign(rows, [](const ContactRow& row) { return row.key(); });
  int pair = rows.empty() ? -1 : rows.back().pair;
  const ContactRow* before = nullptr;
  for (const ContactRow& last : memory.rows) {
    const auto goes_on = [&](const ContactSide& side) { return is_whole_and_free(side, bodies[side.body]); };
    if (found.find(last.key()) >= 0 || !std::ranges::all_of(last.sides, goes_on)) continue;
    if (has_slid_off(last, bodies)) continue;
    if (before == nullptr || before->pair != last.pair) ++pair;
    before = &last;
    ContactRow& row = rows.emplace_back(last);
    row.depth = std::min(0.0, last.depth);
    row.target = row.depth / dt;
    row.pair = pair;
    ++row.lasted;
  }
}

}  // namespace crumple::sim::contact
