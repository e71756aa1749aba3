#pragma once

#include "common/types.h"

#include <span>
#include <vector>

namespace crumple::sim::fracture {

// The pieces of a body: tets that are connected through shared faces.
struct Fragments {
  std::vector<int> of_tet;  // piece of each tet; pieces are numbered by their lowest tet
  std::vector<int> size;    // tets in each piece

  int count() const { return static_cast<int>(size.size()); }
};

Fragments find_fragments(std::span<const Tet> tets);

}  // namespace crumple::sim::fracture
