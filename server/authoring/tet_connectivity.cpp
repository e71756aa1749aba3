#include "server/authoring/tet_connectivity.h"

#include "server/sim/mesh/node_stars.h"
#include "server/sim/mesh/tet_faces.h"

namespace crumple::authoring {

std::vector<std::array<int, 4>> face_neighbours(const std::vector<Tet>& tets) {
  const std::vector<sim::FaceOfTet> faces = sim::sorted_faces(tets);
  std::vector<std::array<int, 4>> neighbours(tets.size(), {-1, -1, -1, -1});
  for (size_t f = 0; f + 1 < faces.size(); ++f) {
    const sim::FaceOfTet &a = faces[f], &b = faces[f + 1];
    if (!a.same_face(b)) continue;
    neighbours[a.tet][a.opposite] = b.tet;
    neighbours[b.tet][b.opposite] = a.tet;
  }
  return neighbours;
}

FaceParts face_parts(const std::vector<std::array<int, 4>>& neighbours) {
  FaceParts parts{0, std::vector<int>(neighbours.size(), -1)};
  std::vector<int> stack;
  for (int seed = 0; seed < static_cast<int>(neighbours.size()); ++seed) {
    if (parts.part[seed] >= 0) continue;
    parts.part[seed] = parts.count;
    stack.push_back(seed);
    while (!stack.empty()) {
      const int t = stack.back();
      stack.pop_back();
      for (const int other : neighbours[t])
        if (other >= 0 && parts.part[other] < 0) {
          parts.part[other] = parts.count;
          stack.push_back(other);
        }
    }
    ++parts.count;
  }
  return parts;
}

std::vector<int> pinched_nodes(const std::vector<Tet>& tets, const std::vector<std::array<int, 4>>& neighbours,
                               int node_count) {
  const sim::NodeStars tets_of(tets, node_count);
  std::vector<int> pinched, reached_for(tets.size(), -1), stack;
  for (int node = 0; node < node_count; ++node) {
    if (tets_of[node].empty()) continue;
    size_t reached = 1;
    stack.assign(1, tets_of[node].front());
    reached_for[stack.front()] = node;
    while (!stack.empty()) {
      const int t = stack.back();
      stack.pop_back();
      for (int k = 0; k < 4; ++k) {
        const int other = neighbours[t][k];
        if (tets[t][k] == node || other < 0 || reached_for[other] == node) continue;
        reached_for[other] = node;
        stack.push_back(other);
        ++reached;
      }
    }
    if (reached < tets_of[node].size()) pinched.push_back(node);
  }
  return pinched;
}

}  // namespace crumple::authoring
