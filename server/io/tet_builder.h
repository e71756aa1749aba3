#pragma once

#include "server/io/tet_import.h"

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

namespace crumple::io {

// Nodes and tets as a file names them, by tags of its own, on the way to a mesh.
class TetBuilder {
 public:
  // False where the tag is taken.
  bool add_node(std::int64_t tag, const Vec3& X);
  // Tags of nodes that may come later, and the part of the body that the tet is of; 0: none.
  void add_tet(const std::array<std::int64_t, 4>& tags, int part = 0) {
    tets_.push_back(tags);
    parts_.push_back(part);
  }
  void set_part(std::size_t tet, int part) { parts_[tet] = part; }
  void forget_parts() { parts_.assign(parts_.size(), 0); }

  std::size_t node_count() const { return X_.size(); }
  std::size_t tet_count() const { return tets_.size(); }

  int other_elements = 0;

  // Nodes in file order without the unused ones, tets turned to positive volume, parts as the mesh's tags unless all are
  // 0, validated. `name` stands in errors.
  Result<ImportedTets> build(const std::string& name) const;

 private:
  std::vector<Vec3> X_;
  std::unordered_map<std::int64_t, int> id_of_;
  std::vector<std::array<std::int64_t, 4>> tets_;
  std::vector<int> parts_;
};

}  // namespace crumple::io
