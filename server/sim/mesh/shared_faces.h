#pragma once

#include "common/types.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace crumple::sim {

// The faces that two tets of a rest mesh share, and which of them have come apart since. Tets keep their ids of the rest
// mesh, whatever becomes of their nodes.
class SharedFaces {
 public:
  SharedFaces() = default;  // none
  explicit SharedFaces(std::span<const Tet> tets);

  struct Face {
    std::array<int, 2> tet;       // ascending
    std::array<int, 2> opposite;  // local index 0..3 of the node of each that is not on it
  };
  int count() const { return static_cast<int>(faces_.size()); }
  const Face& operator[](int face) const { return faces_[face]; }
  bool is_whole(int face) const { return whole_[face] != 0; }

  // nodes(t): four numbers that tell the nodes of tet t, equal where two tets have a node in common. Looks at all faces
  // that were whole, and gives those that are not any more, ascending. What has parted stays so.
  using NodesOf = std::function<std::array<std::uint64_t, 4>(int)>;
  std::vector<int> part(const NodesOf& nodes);

 private:
  std::vector<Face> faces_;  // ascending by their node ids at rest
  std::vector<char> whole_;
};

}  // namespace crumple::sim
