#include "server/authoring/handle_stage.h"

#include "common/text.h"
#include "server/authoring/handle_placement.h"
#include "server/authoring/rig_weights.h"
#include "server/authoring/tet_laplacian.h"
#include "server/sim/mesh/tet_tree.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace crumple::authoring {
namespace {

using sim::example_based::ExampleSet;
using sim::example_based::kMaxBones;
using NamedHandle = sim::example_based::Handle;
using Weights = RigOptions::Weights;

// Handles named "auto 1" and on.
void add_automatic(const std::vector<Vec3>& points, RigHandles& handles, RigReport& report) {
  for (const Vec3& p : points) {
    std::string name = text("auto ", ++report.automatic_handles);
    while (std::ranges::any_of(handles.named, [&](const NamedHandle& h) { return h.name == name; })) name += "'";
    handles.add_point({name, p});
  }
}

// A joint of a skin, as a point or as a bone that ends in the middle of its children.
void add_joint(const ArtistMesh& mesh, std::size_t joint, RigOptions::Joints joints, RigHandles& handles) {
  Vec3 sum = Vec3::Zero();
  int children = 0;
  for (std::size_t c = 0; joints == RigOptions::Joints::bones && c < mesh.parents.size(); ++c)
    if (mesh.parents[c] == static_cast<int>(joint)) sum += mesh.handles[c].position, ++children;
  const NamedHandle& own = mesh.handles[joint];
  const Vec3 end = children > 0 ? Vec3(sum / children) : own.position;
  if (end == own.position)
    handles.add_point(own);
  else
    handles.add_bone({own.name, own.position, end});
}

double longest_side(const sim::TetMesh& tets) {
  Eigen::AlignedBox3d box;
  for (const Vec3& X : tets.X) box.extend(X);
  return box.sizes().maxCoeff();
}

// How far outside of the tets the farthest handle is [m], and a warning for each that is more than an edge away.
double reach_of(const sim::TetMesh& tets, const RigHandles& handles, RigReport& report) {
  const sim::TetTree tree(tets);
  const double edge = mean_edge_length(tets);
  double reach = edge;
  for (int b = 0; b < handles.count(); ++b) {
    const Handle& shape = handles.shapes.handles[b];
    const double away = distance_outside(tree, shape, edge / 8);
    // prescribed_weights looks at other places of a bone, at most a fourth of an edge apart.
    reach = std::max(reach, (1 + 1e-9) * away + (shape.is_point() || away <= edge ? 0 : edge / 4));
    if (away > edge)
      report.warnings.push_back(text("handle \"", handles.named[b].name, "\" is ", away,
                                     " m outside of the tets; it acts on what is nearest"));
  }
  return reach;
}

// What the weights say of handles[7], said of its name.
Error by_name(Error error, const RigHandles& handles) {
  int b = -1;
  if (std::sscanf(error.field.c_str(), "handles[%d]", &b) == 1 && b >= 0 && b < handles.count())
    error.field = "handle \"" + handles.named[b].name + "\"";
  return error;
}

Result<Eigen::MatrixXd> painted_weights(const ArtistMesh& mesh, const ExampleSet& set, const RigHandles& handles,
                                        const SurfaceTransfer& to_nodes, RigReport& report) {
  Eigen::MatrixXd W = to_nodes(mesh.weights.transpose()).transpose();
  const Eigen::VectorXd sums = W.rowwise().sum();
  const auto bare = (sums.array() < 1e-3).count();
  Eigen::MatrixXd computed;
  if (bare > 0) {
    report.warnings.push_back(
        text(bare, " of ", W.rows(), " nodes lie at parts without joint weights; theirs are computed"));
    auto made =
        rig_weights(set.mesh, handles.shapes, RigWeights::bounded_biharmonic, reach_of(set.mesh, handles, report));
    if (!made) return std::unexpected(by_name(made.error(), handles));
    computed = std::move(made->W);
  }
  for (Eigen::Index i = 0; i < W.rows(); ++i)
    W.row(i) = sums[i] < 1e-3 ? computed.row(i).eval() : (W.row(i) / sums[i]).eval();
  return W;
}

// Handles are added until the mesh's copies are met; their weights.
Result<Eigen::MatrixXd> grown_weights(const ArtistMesh& mesh, const RigOptions& o, const ExampleSet& set,
                                      RigHandles& handles, RigReport& report) {
  ShapeRigOptions options{.tolerance = o.tolerance, .most_handles = o.most_handles};
  options.first_handles = std::min(options.first_handles, options.most_handles);
  options.turn_penalty = kTurnPenalty;
  options.weights.reach = reach_of(set.mesh, handles, report);
  auto rig = rig_from_shapes(set.mesh, set.render, mesh.copies, handles.shapes, options);
  if (!rig) return std::unexpected(by_name(rig.error(), handles));
  std::vector<Vec3> added;
  for (int b = handles.count(); b < rig->handles.count(); ++b) added.push_back(rig->handles.handles[b].from);
  add_automatic(added, handles, report);
  report.rounds = std::move(rig->rounds);
  report.tolerance_met = rig->reached;
  if (!rig->reached)
    report.warnings.push_back(text("the tolerance of ", o.tolerance, " is not met with ", handles.count(),
                                   " handles; finer tets or more handles may"));
  return std::move(rig->W);
}

}  // namespace

bool is_painted(const ArtistMesh& mesh) {
  return mesh.weights.rows() > 0 && mesh.weights.rows() == static_cast<Eigen::Index>(mesh.surface.vertices.size());
}

Result<RigHandles> all_handles(const ArtistMesh& mesh, const RigOptions& o, const sim::TetMesh& tets,
                               const std::vector<int>& surface, RigReport& report) {
  if (!o.handles.empty())
    if (auto ok = validate(o.handles); !ok) return std::unexpected(ok.error());
  RigHandles handles;
  for (std::size_t j = 0; j < mesh.handles.size(); ++j) add_joint(mesh, j, o.joints, handles);
  handles.add(o.handles);
  for (std::size_t a = 0; a < handles.named.size(); ++a) {
    if (!handles.named[a].position.allFinite()) return invalid(text("handles[", a, "].position"), "is not finite");
    for (std::size_t b = 0; b < a; ++b)
      if (handles.named[a].name == handles.named[b].name)
        return invalid("handles", "\"" + handles.named[a].name + "\" is the name of two handles, must be of one");
  }
  report.given_handles = handles.count();
  const sim::TetTree tree(tets);
  const double farthest = longest_side(tets), spacing = mean_edge_length(tets) / 8;
  for (int b = static_cast<int>(mesh.handles.size()); b < handles.count(); ++b)
    if (const double away = distance_outside(tree, handles.shapes.handles[b], spacing); away > farthest)
      return invalid("handle \"" + handles.named[b].name + "\"",
                     text("is ", away, " m outside of the tets, must be within ", farthest,
                          " m, their longest side: is it in other units or axes than the mesh?"));
  const int first = o.tolerance > 0 ? std::min(ShapeRigOptions{}.first_handles, o.most_handles) : kDefaultHandles;
  const int wanted = o.automatic_handles >= 0 ? o.automatic_handles : handles.named.empty() ? first : 0;
  if (wanted > 0)
    add_automatic(points_of(tets, place_handles(tets, surface, wanted, {.given = places_of(handles.shapes)})), handles,
                  report);
  if (report.automatic_handles < wanted)
    report.warnings.push_back(text("only ", report.automatic_handles, " of ", wanted,
                                   " automatic handles are there: the tets have no more places on their surface"));
  if (handles.named.empty()) return invalid("automatic_handles", "is 0 and no handle is given, must be at least 1");
  if (handles.count() > kMaxBones)
    return invalid("handles", text("are ", handles.count(), " with automatic ones, must be at most ", kMaxBones));
  return handles;
}

Result<Eigen::MatrixXd> weights_of(const ArtistMesh& mesh, const RigOptions& o, const ExampleSet& set,
                                   RigHandles& handles, const SurfaceTransfer& to_nodes, RigReport& report) {
  const bool painted = is_painted(mesh), others = handles.named.size() > mesh.handles.size(),
             as_painted = !others && o.joints == RigOptions::Joints::points && !(o.tolerance > 0);
  report.weights = o.weights != Weights::by_mesh ? o.weights
                   : painted && as_painted       ? Weights::painted
                                                 : Weights::bounded_biharmonic;
  if (report.weights == Weights::gaussian && !handles.are_points())
    return invalid("weights", "are to be Gaussian beside bones or cages, must be biharmonic there");
  if (report.weights == Weights::painted) return painted_weights(mesh, set, handles, to_nodes, report);
  if (painted && o.weights == Weights::by_mesh)
    report.warnings.push_back(std::string("the mesh's joint weights are left out: ") +
                              (others ? "there are handles that have none" : "they are computed anew"));
  if (o.tolerance > 0) return grown_weights(mesh, o, set, handles, report);
  auto made = rig_weights(set.mesh, handles.shapes,
                          report.weights == Weights::gaussian ? RigWeights::gaussian : RigWeights::bounded_biharmonic,
                          reach_of(set.mesh, handles, report));
  if (!made) return std::unexpected(by_name(made.error(), handles));
  report.warnings.insert(report.warnings.end(), made->warnings.begin(), made->warnings.end());
  return std::move(made->W);
}

}  // namespace crumple::authoring
