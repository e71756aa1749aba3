#include "server/io/tet_builder.h"

#include "common/text.h"

#include <algorithm>
#include <utility>

namespace crumple::io {
namespace {

void drop_unused_nodes(ImportedTets& out) {
  std::vector<char> used(out.mesh.X.size(), false);
  for (const Tet& tet : out.mesh.tets)
    for (const int node : tet) used[node] = true;
  std::vector<int> new_id(used.size(), -1);
  int kept = 0;
  for (size_t n = 0; n < used.size(); ++n)
    if (used[n]) {
      out.mesh.X[kept] = out.mesh.X[n];
      new_id[n] = kept++;
    }
  out.unused_nodes = static_cast<int>(used.size()) - kept;
  out.mesh.X.resize(kept);
  for (Tet& tet : out.mesh.tets)
    for (int& node : tet) node = new_id[node];
}

}  // namespace

bool TetBuilder::add_node(std::int64_t tag, const Vec3& X) {
  if (!id_of_.try_emplace(tag, static_cast<int>(X_.size())).second) return false;
  X_.push_back(X);
  return true;
}

Result<ImportedTets> TetBuilder::build(const std::string& name) const {
  if (tets_.empty()) return invalid(name, "has no tet");
  ImportedTets out;
  out.other_elements = other_elements;
  out.mesh.X = X_;
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    Tet tet;
    for (int k = 0; k < 4; ++k) {
      const auto at = id_of_.find(tets_[t][k]);
      if (at == id_of_.end())
        return invalid(text(name, ", tet ", t + 1), text("names node ", tets_[t][k], ", which is not there"));
      tet[k] = at->second;
    }
    out.mesh.tets.push_back(tet);
    if (sim::signed_volume(out.mesh, static_cast<int>(t)) < 0) {
      std::swap(out.mesh.tets.back()[2], out.mesh.tets.back()[3]);
      ++out.flipped;
    }
  }
  drop_unused_nodes(out);
  if (std::ranges::any_of(parts_, [](int part) { return part != 0; })) out.mesh.tags = parts_;
  if (auto valid = sim::validate(out.mesh, name); !valid) return std::unexpected(valid.error());
  return out;
}

}  // namespace crumple::io
