#include "server/authoring/handle_stage.h"

#include "common/text.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/rig_weights.h"
#include "server/authoring/tet_laplacian.h"
#include "server/sim/mesh/tet_tree.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::ExampleSet;
using sim::example_based::kMaxBones;
using NamedHandle = sim::example_based::Handle;
using Weights = RigOptions::Weights;

// Handles named "auto 1" and on.
void add_automatic(const std::vector<Vec3>& points, std::vector<NamedHandle>& handles, RigReport& report) {
  for (const Vec3& p : points) {
    std::string name = text("auto ", ++report.automatic_handles);
    while (std::ranges::any_of(handles, [&](const NamedHandle& h) { return h.name == name; })) name += "'";
    handles.push_back({name, p});
  }
}

// How far outside of the tets the farthest handle is, and a warning for each that is more than an edge away [m].
double reach_of(const sim::TetMesh& tets, const std::vector<NamedHandle>& handles, RigReport& report) {
  const sim::TetTree tree(tets);
  const double edge = mean_edge_length(tets);
  double reach = edge;
  for (const NamedHandle& h : handles) {
    const double away = std::sqrt(tree.nearest(h.position).squared_distance);
    reach = std::max(reach, (1 + 1e-9) * away);
    if (away > edge)
      report.warnings.push_back(
          text("handle \"", h.name, "\" is ", away, " m outside of the tets; it acts on what is nearest"));
  }
  return reach;
}

Result<Eigen::MatrixXd> painted_weights(const ArtistMesh& mesh, const ExampleSet& set, const SurfaceTransfer& to_nodes,
                                        RigReport& report) {
  Eigen::MatrixXd W = to_nodes(mesh.weights.transpose()).transpose();
  const Eigen::VectorXd sums = W.rowwise().sum();
  const auto bare = (sums.array() < 1e-3).count();
  Eigen::MatrixXd computed;
  if (bare > 0) {
    report.warnings.push_back(
        text(bare, " of ", W.rows(), " nodes lie at parts without joint weights; theirs are computed"));
    auto made = rig_weights(set.mesh, points_of(set.handles), RigWeights::bounded_biharmonic,
                            reach_of(set.mesh, set.handles, report));
    if (!made) return std::unexpected(made.error());
    computed = std::move(made->W);
  }
  for (Eigen::Index i = 0; i < W.rows(); ++i)
    W.row(i) = sums[i] < 1e-3 ? computed.row(i).eval() : (W.row(i) / sums[i]).eval();
  return W;
}

// Handles are added to the set's until the mesh's copies are met; their weights.
Result<Eigen::MatrixXd> grown_weights(const ArtistMesh& mesh, const RigOptions& o, ExampleSet& set, RigReport& report) {
  Handles given;
  for (const Vec3& p : points_of(set.handles)) given.handles.push_back(Handle::point(p));
  ShapeRigOptions options{.tolerance = o.tolerance, .most_handles = o.most_handles};
  options.first_handles = std::min(options.first_handles, options.most_handles);
  options.turn_penalty = kTurnPenalty;
  options.weights.reach = reach_of(set.mesh, set.handles, report);
  auto rig = rig_from_shapes(set.mesh, set.render, mesh.copies, given, options);
  if (!rig) return std::unexpected(rig.error());
  std::vector<Vec3> added;
  for (int b = given.count(); b < rig->handles.count(); ++b) added.push_back(rig->handles.handles[b].from);
  add_automatic(added, set.handles, report);
  report.rounds = std::move(rig->rounds);
  report.tolerance_met = rig->reached;
  if (!rig->reached)
    report.warnings.push_back(text("the tolerance of ", o.tolerance, " is not met with ", set.handles.size(),
                                   " handles; finer tets or more handles may"));
  return std::move(rig->W);
}

}  // namespace

bool is_painted(const ArtistMesh& mesh) {
  return mesh.weights.rows() > 0 && mesh.weights.rows() == static_cast<Eigen::Index>(mesh.surface.vertices.size());
}

Result<std::vector<NamedHandle>> all_handles(const ArtistMesh& mesh, const RigOptions& o, const sim::TetMesh& tets,
                                             const std::vector<int>& surface, RigReport& report) {
  std::vector<NamedHandle> handles = mesh.handles;
  handles.insert(handles.end(), o.handles.begin(), o.handles.end());
  for (std::size_t a = 0; a < handles.size(); ++a) {
    if (!handles[a].position.allFinite()) return invalid(text("handles[", a, "].position"), "is not finite");
    for (std::size_t b = 0; b < a; ++b)
      if (handles[a].name == handles[b].name)
        return invalid("handles", "\"" + handles[a].name + "\" is the name of two handles, must be of one");
  }
  report.given_handles = static_cast<int>(handles.size());
  const int first = o.tolerance > 0 ? std::min(ShapeRigOptions{}.first_handles, o.most_handles) : kDefaultHandles;
  const int wanted = o.automatic_handles >= 0 ? o.automatic_handles : handles.empty() ? first : 0;
  if (wanted > 0)
    add_automatic(points_of(tets, place_handles(tets, surface, wanted, {.given = points_of(handles)})), handles,
                  report);
  if (report.automatic_handles < wanted)
    report.warnings.push_back(text("only ", report.automatic_handles, " of ", wanted,
                                   " automatic handles are there: the tets have no more places on their surface"));
  if (handles.empty()) return invalid("automatic_handles", "is 0 and no handle is given, must be at least 1");
  if (handles.size() > static_cast<std::size_t>(kMaxBones))
    return invalid("handles", text("are ", handles.size(), " with automatic ones, must be at most ", kMaxBones));
  return handles;
}

Result<Eigen::MatrixXd> weights_of(const ArtistMesh& mesh, const RigOptions& o, ExampleSet& set,
                                   const SurfaceTransfer& to_nodes, RigReport& report) {
  const bool painted = is_painted(mesh), others = set.handles.size() > mesh.handles.size();
  report.weights = o.weights != Weights::by_mesh              ? o.weights
                   : painted && !others && !(o.tolerance > 0) ? Weights::painted
                                                              : Weights::bounded_biharmonic;
  if (report.weights == Weights::painted) return painted_weights(mesh, set, to_nodes, report);
  if (painted && o.weights == Weights::by_mesh)
    report.warnings.push_back("the mesh's joint weights are left out: there are handles that have none");
  if (o.tolerance > 0) return grown_weights(mesh, o, set, report);
  auto made = rig_weights(set.mesh, points_of(set.handles),
                          report.weights == Weights::gaussian ? RigWeights::gaussian : RigWeights::bounded_biharmonic,
                          reach_of(set.mesh, set.handles, report));
  if (!made) return std::unexpected(made.error());
  report.warnings.insert(report.warnings.end(), made->warnings.begin(), made->warnings.end());
  return std::move(made->W);
}

}  // namespace crumple::authoring
