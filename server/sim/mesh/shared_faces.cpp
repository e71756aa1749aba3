#include "server/sim/mesh/shared_faces.h"

#include "server/sim/mesh/tet_faces.h"

#include <algorithm>

namespace crumple::sim {

SharedFaces::SharedFaces(std::span<const Tet> tets) {
  const std::vector<FaceOfTet> sorted = sorted_faces(tets);
  for (std::size_t f = 1; f < sorted.size(); ++f) {
    const FaceOfTet &a = sorted[f - 1], &b = sorted[f];
    if (a.same_face(b)) faces_.push_back({{a.tet, b.tet}, {a.opposite, b.opposite}});
  }
  whole_.assign(faces_.size(), 1);
}

std::vector<int> SharedFaces::part(const NodesOf& nodes) {
  std::vector<int> parted;
  for (int f = 0; f < count(); ++f) {
    if (!whole_[f]) continue;
    std::array<std::array<std::uint64_t, 3>, 2> corners;
    for (int side = 0; side < 2; ++side) {
      const std::array<std::uint64_t, 4> all = nodes(faces_[f].tet[side]);
      for (int k = 0; k < 3; ++k) corners[side][k] = all[kTetFaces[faces_[f].opposite[side]][k]];
      std::ranges::sort(corners[side]);
    }
    if (corners[0] == corners[1]) continue;
    whole_[f] = 0;
    parted.push_back(f);
  }
  return parted;
}

}  // namespace crumple::sim
