#include "server/authoring/polyhedron.h"

#include "common/text.h"
#include "server/authoring/polygon_triangles.h"
#include "server/sim/mesh/disjoint_sets.h"
#include "server/sim/mesh/weld.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <numeric>
#include <unordered_map>

namespace crumple::authoring {
namespace {

using Edge = std::pair<int, int>;

// Directed edges, chained to loops. Each end of an edge is the begin of another.
std::vector<std::vector<int>> chain(std::vector<Edge> edges) {
  std::ranges::sort(edges);
  std::vector<char> used(edges.size(), 0);
  std::vector<std::vector<int>> loops;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    std::vector<int> loop;
    for (std::size_t e = first; !used[e];) {
      used[e] = 1;
      loop.push_back(edges[e].first);
      e = static_cast<std::size_t>(std::ranges::lower_bound(edges, Edge{edges[e].second, -1}) - edges.begin());
      const int begin = e < edges.size() ? edges[e].first : -1;
      while (e < edges.size() && used[e] && edges[e].first == begin) ++e;
      if (e == edges.size() || edges[e].first != begin) break;  // back where the loop began
    }
    if (loop.size() > 2) loops.push_back(std::move(loop));  // two edges there and back close each other
  }
  return loops;
}

class Clipper {
 public:
  Clipper(Polyhedron solid, const Vec3& normal, double offset) : solid_(std::move(solid)), height_(solid_.points.size()) {
    for (std::size_t p = 0; p < height_.size(); ++p) height_[p] = normal.dot(solid_.points[p]) - offset;
  }

  Polyhedron clip(int label) {
    const auto above = std::ranges::count_if(height_, [](double h) { return h > 0; });
    if (above == 0) return std::move(solid_);
    if (above == std::ssize(height_)) return {};
    new_id_.assign(height_.size(), -1);
    for (const Polyhedron::Face& face : solid_.faces) add_faces(face.label, below(face));
    add_faces(label, chain(std::move(cap_edges_)));
    return std::move(cut_);
  }

 private:
  void add_faces(int label, const std::vector<std::vector<int>>& loops) {
    if (loops.empty()) return;
    for (LoopGroup& group : grouped(cut_.points, loops)) cut_.faces.push_back({label, std::move(group)});
  }

  // The loops of what is left of a face: each way below the plane goes on with the one that begins where it leaves, straight
  // across the face; the cap goes back there.
  std::vector<std::vector<int>> below(const Polyhedron::Face& face) {
    std::vector<std::vector<int>> loops, ways;
    std::vector<int> next;  // way after each
    for (const std::vector<int>& loop : face.loops) {
      const std::size_t first = ways.size();
      add_ways(loop, loops, ways);
      for (std::size_t w = first; w < ways.size(); ++w)  // as the loop has them
        next.push_back(static_cast<int>(w + 1 < ways.size() ? w + 1 : first));
    }
    if (ways.size() > 1) pair_across(ways, next);
    std::vector<char> used(ways.size(), 0);
    for (std::size_t w = 0; w < ways.size(); ++w) cap_edges_.emplace_back(ways[next[w]].front(), ways[w].back());
    for (std::size_t first = 0; first < ways.size(); ++first) {
      std::vector<int> loop;
      for (std::size_t w = first; !used[w]; w = static_cast<std::size_t>(next[w])) {
        used[w] = 1;
        loop.insert(loop.end(), ways[w].begin(), ways[w].end());
      }
      if (!loop.empty()) loops.push_back(std::move(loop));
    }
    return loops;
  }

  // A loop that is all below stays; of others the ways from where they come below to where they leave again.
  void add_ways(const std::vector<int>& loop, std::vector<std::vector<int>>& whole, std::vector<std::vector<int>>& ways) {
    const auto is_below = [&](std::size_t k) { return height_[loop[k % loop.size()]] <= 0; };
    std::size_t start = 0;
    while (start < loop.size() && (is_below(start) || !is_below(start + 1))) ++start;
    if (start == loop.size()) {  // crosses nowhere
      if (!is_below(0)) return;
      whole.emplace_back();
      for (const int p : loop) whole.back().push_back(kept(p));
      return;
    }
    for (std::size_t k = start; k < start + loop.size(); ++k) {
      const int a = loop[k % loop.size()], b = loop[(k + 1) % loop.size()];
      if (is_below(k)) ways.back().push_back(kept(a));
      if (is_below(k) == is_below(k + 1)) continue;
      if (is_below(k + 1)) ways.emplace_back();
      ways.back().push_back(cut(a, b));
    }
  }

  // Of several ways, those belong together between which the plane's line through the face runs inside of it: along the line,
  // every other stretch. Where rounding denies that, they stay as the loops have them.
  void pair_across(const std::vector<std::vector<int>>& ways, std::vector<int>& next) const {
    Eigen::AlignedBox3d box;
    for (const std::vector<int>& way : ways) box.extend(cut_.points[way.front()]).extend(cut_.points[way.back()]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    struct End { double at; int way; bool leaves; };
    std::vector<End> ends;
    for (int w = 0; w < static_cast<int>(ways.size()); ++w) {
      ends.push_back({cut_.points[ways[w].front()][axis], w, false});
      ends.push_back({cut_.points[ways[w].back()][axis], w, true});
    }
    std::ranges::sort(ends, {}, &End::at);
    std::vector<int> paired(next.size());
    for (std::size_t e = 0; e < ends.size(); e += 2) {
      if (ends[e].leaves == ends[e + 1].leaves) return;
      const auto& [from, to] = ends[e].leaves ? std::pair(ends[e], ends[e + 1]) : std::pair(ends[e + 1], ends[e]);
      paired[from.way] = to.way;
    }
    next = std::move(paired);
  }

  int kept(int p) {
    if (new_id_[p] < 0) {
      new_id_[p] = static_cast<int>(cut_.points.size());
      cut_.points.push_back(solid_.points[p]);
    }
    return new_id_[p];
  }

  int cut(int a, int b) {
    const Edge edge = std::minmax(a, b);
    const auto [at, is_new] = cuts_.try_emplace((std::uint64_t(edge.first) << 32) | std::uint32_t(edge.second), cut_.points.size());
    if (is_new) {
      const auto [p, q] = edge;
      const double s = height_[p] / (height_[p] - height_[q]);
      cut_.points.push_back(solid_.points[p] + s * (solid_.points[q] - solid_.points[p]));
    }
    return static_cast<int>(at->second);
  }

  Polyhedron solid_, cut_;
  std::vector<double> height_;  // of points above the plane
  std::vector<int> new_id_;
  std::unordered_map<std::uint64_t, std::size_t> cuts_;
  std::vector<Edge> cap_edges_;
};

}  // namespace

Result<Polyhedron> polyhedron_of(const sim::SurfaceMesh& surface) {
  Polyhedron solid;
  const std::vector<int> first = sim::weld(surface.vertices, 0);
  std::vector<int> id;
  for (std::size_t v = 0; v < first.size(); ++v) {
    const bool is_first = first[v] == static_cast<int>(v);
    id.push_back(is_first ? static_cast<int>(solid.points.size()) : id[first[v]]);
    if (is_first) solid.points.push_back(surface.vertices[v]);
  }
  std::map<Edge, int> open;  // directed edges, less those in the other direction
  for (const Triangle& t : surface.triangles) {
    const std::vector<int> loop{id[t[0]], id[t[1]], id[t[2]]};
    if (loop[0] == loop[1] || loop[1] == loop[2] || loop[2] == loop[0]) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = loop[k], b = loop[(k + 1) % 3];
      open[std::minmax(a, b)] += a < b ? 1 : -1;
    }
    solid.faces.push_back({Polyhedron::kOutside, {loop}});
  }
  const auto unpaired = std::ranges::count_if(open, [](const auto& edge) { return edge.second != 0; });
  if (unpaired > 0)
    return invalid("", text("has ", unpaired, " edges at which its triangles do not meet in pairs that run the same way round, must be closed"));
  if (const double inside = volume(solid); !(inside > 0))
    return invalid("", text("encloses ", inside, " m^3, must be above 0: triangles run counter-clockwise seen from outside"));
  return solid;
}

Polyhedron polyhedron_of(const Eigen::AlignedBox3d& box) {
  Polyhedron solid;
  for (int corner = 0; corner < 8; ++corner)
    solid.points.push_back(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  for (const std::vector<int>& loop : std::vector<std::vector<int>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    solid.faces.push_back({Polyhedron::kOutside, {loop}});
  return solid;
}

Polyhedron clip(Polyhedron solid, const Vec3& normal, double offset, int label) {
  return Clipper(std::move(solid), normal, offset).clip(label);
}

double volume(const Polyhedron& solid) {
  if (solid.is_empty()) return 0;
  const Vec3& origin = solid.points.front();
  double six = 0;
  for (const Polyhedron::Face& face : solid.faces) {
    for (const std::vector<int>& loop : face.loops) {
      for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
        const Vec3 a = solid.points[loop[0]] - origin;
        six += a.dot((solid.points[loop[k]] - origin).cross(solid.points[loop[k + 1]] - origin));
      }
    }
  }
  return six / 6;
}

Eigen::AlignedBox3d box_of(const Polyhedron& solid) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : solid.points) box.extend(p);
  return box;
}

namespace {

void append(Polyhedron& to, const Polyhedron& part) {
  const int first = static_cast<int>(to.points.size());
  to.points.insert(to.points.end(), part.points.begin(), part.points.end());
  for (Polyhedron::Face face : part.faces) {
    for (std::vector<int>& loop : face.loops)
      for (int& p : loop) p += first;
    to.faces.push_back(std::move(face));
  }
}

// A cavity is of the least part around it.
std::vector<Polyhedron> with_cavities(std::vector<Polyhedron> found) {
  if (found.size() < 2) return found;
  std::vector<Polyhedron> solids, cavities;
  for (Polyhedron& part : found) (volume(part) < 0 ? cavities : solids).push_back(std::move(part));
  for (const Polyhedron& cavity : cavities) {
    const Eigen::AlignedBox3d box = box_of(cavity);
    Polyhedron* around = nullptr;
    for (Polyhedron& solid : solids)
      if (box_of(solid).contains(box) && (!around || volume(solid) < volume(*around))) around = &solid;
    if (around) append(*around, cavity);
  }
  return solids;
}

}  // namespace

std::vector<Polyhedron> parts(const Polyhedron& solid) {
  std::vector<int> part(solid.points.size());
  std::iota(part.begin(), part.end(), 0);
  for (const Polyhedron::Face& face : solid.faces) {
    for (const std::vector<int>& loop : face.loops)
      for (const int p : loop) sim::unite(part, face.loops.front().front(), p);
  }
  std::vector<int> index(part.size(), -1), new_id(part.size(), -1);
  std::vector<Polyhedron> found;
  for (const Polyhedron::Face& face : solid.faces) {
    int& at = index[sim::find_root(part, face.loops.front().front())];
    if (at < 0) {
      at = static_cast<int>(found.size());
      found.emplace_back();
    }
    Polyhedron& own = found[at];
    own.faces.push_back(face);
    for (std::vector<int>& loop : own.faces.back().loops) {
      for (int& p : loop) {
        if (new_id[p] < 0) {
          new_id[p] = static_cast<int>(own.points.size());
          own.points.push_back(solid.points[p]);
        }
        p = new_id[p];
      }
    }
  }
  return with_cavities(std::move(found));
}

}  // namespace crumple::authoring
