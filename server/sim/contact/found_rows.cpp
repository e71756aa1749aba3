#include "server/sim/contact/found_rows.h"

#include <algorithm>

namespace crumple::sim::contact {
namespace {

constexpr double kSliver = 0.03;

}  // namespace

bool share_a_node(const Tet& a, const Tet& b) {
  return std::ranges::any_of(a, [&](int node) { return std::ranges::find(b, node) != b.end(); });
}

void FoundRows::clear() {
  for (OneKind* kind : {&surface, &buried}) kind->rows.clear(), kind->tets.clear();
  certain = false;
}

void FoundRows::push(const ContactRow& row, const Tets& tets, bool from_surface) {
  OneKind& kind = from_surface ? surface : buried;
  kind.rows.push_back(row);
  kind.tets.push_back(tets);
}

void FoundRows::leave_out_slivers() {
  surface.leave_out_slivers();
  if (!certain) buried.leave_out_slivers();
}

void FoundRows::OneKind::leave_out_slivers() {
  thread_local std::array<std::vector<int>, 2> widest;  // row of a tet; -1 between calls
  for (int k = 0; k < static_cast<int>(rows.size()); ++k)
    for (int side = 0; side < 2; ++side) {
      const std::size_t id = tets[k][side]->id;
      if (widest[side].size() <= id) widest[side].resize(id + 1, -1);
      int& row = widest[side][id];
      if (row < 0 || rows[k].area > rows[row].area) row = k;
    }
  const auto is_sliver = [&](std::size_t k) {
    for (int side = 0; side < 2; ++side) {
      const int wide = widest[side][tets[k][side]->id];
      if (rows[k].area < kSliver * rows[wide].area && share_a_node(tets[k][1 - side]->nodes, tets[wide][1 - side]->nodes)) return true;
    }
    return false;
  };
  thread_local std::vector<char> leave;
  leave.assign(rows.size(), 0);
  for (std::size_t k = 0; k < rows.size(); ++k) leave[k] = is_sliver(k);
  for (const Tets& both : tets)
    for (int side = 0; side < 2; ++side) widest[side][both[side]->id] = -1;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (leave[k]) continue;
    if (kept < k) rows[kept] = rows[k], tets[kept] = tets[k];
    ++kept;
  }
  rows.resize(kept);
  tets.resize(kept);
}

void FoundRows::append_to(std::vector<ContactRow>& all, bool surface_alone) const {
  all.insert(all.end(), surface.rows.begin(), surface.rows.end());
  if (!surface_alone) all.insert(all.end(), buried.rows.begin(), buried.rows.end());
}

}  // namespace crumple::sim::contact
