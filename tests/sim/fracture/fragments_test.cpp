#include "server/sim/fracture/fragments.h"

#include "tests/support/kuhn_lattice.h"

#include <gtest/gtest.h>

namespace crumple::sim::fracture {
namespace {

TEST(Fragments, ALatticeIsOnePiece) {
  const auto fragments = find_fragments(test::kuhn_lattice({3, 3, 3}, 1).tets);
  EXPECT_EQ(fragments.count(), 1);
  EXPECT_EQ(fragments.size[0], 6 * 27);
}

TEST(Fragments, AnEdgeOrANodeDoesNotConnect) {
  const std::vector<Tet> tets{{0, 1, 2, 3}, {0, 1, 4, 5}, {3, 6, 7, 8}, {1, 2, 3, 9}};
  const auto fragments = find_fragments(tets);
  EXPECT_EQ(fragments.count(), 3);
  EXPECT_EQ(fragments.of_tet, (std::vector<int>{0, 1, 2, 0}));
  EXPECT_EQ(fragments.size, (std::vector<int>{2, 1, 1}));
}

TEST(Fragments, AreNumberedByTheirLowestTet) {
  // Two lattices, tet by tet in turn, the second one first.
  const auto a = test::kuhn_lattice({2, 1, 1}, 1).tets;
  std::vector<Tet> tets;
  for (Tet tet : a) {
    Tet other = tet;
    for (int& n : other) n += 100;
    tets.push_back(other);
    tets.push_back(tet);
  }
  const auto fragments = find_fragments(tets);
  EXPECT_EQ(fragments.count(), 2);
  for (std::size_t t = 0; t < tets.size(); ++t) EXPECT_EQ(fragments.of_tet[t], static_cast<int>(t % 2));
}

}  // namespace
}  // namespace crumple::sim::fracture
