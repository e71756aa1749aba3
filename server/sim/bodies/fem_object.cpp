#include "server/sim/bodies/fem_object.h"

#include "server/sim/mesh/tet_faces.h"
#include "server/sim/scatter.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace crumple::sim {

Result<FemObject> FemObject::make(const BodyDescription& body, const FemModel& model, int soft, const SoftBody& first) {
  FemObject object;
  object.id_ = first.id;
  object.name_ = body.name;
  object.colour_ = body.colour;
  object.opacity_ = body.opacity;
  object.pieces_ = {{soft}};
  for (int n = 0; n < first.node_count(); ++n) object.scene_nodes_.push_back({0, n});
  for (int t = 0; t < static_cast<int>(first.tets.size()); ++t) object.scene_tets_.push_back({0, t});
  if (model.splinters || first.rest.dusty()) object.faces_ = SharedFaces(first.tets);
  auto skin = SoftSkin::make(model, first.rest.breakable(), object.faces_);
  if (!skin) return std::unexpected(skin.error());
  object.skin_ = *std::move(skin);
  return object;
}

int FemObject::connected_pieces(std::span<const SoftBody> soft) const {
  int count = rigid_pieces();
  for_each_mesh(soft, [&](const SoftBody& mesh) { count += mesh.components(); });
  return count;
}

int FemObject::rigid_pieces() const { return static_cast<int>(std::ranges::count_if(pieces_, &Piece::is_rigid)); }

void FemObject::follow(const SoftBody& from, const SoftBody::HandOver& moved, std::span<const Piece> left) {
  const int first = static_cast<int>(pieces_.size());
  const auto to = [&](int left_as) { return left_as < 0 ? from.piece : first + left_as; };
  std::vector<NodeRef> node;
  for (const NodeRef& at : moved.node) node.push_back({to(at.piece), at.node});
  for (NodeRef& at : scene_nodes_)
    if (at.piece == from.piece) at = node[at.node];
  for (TetRef& at : scene_tets_)
    if (at.piece == from.piece) at = {to(moved.tet[at.tet].piece), moved.tet[at.tet].tet};
  skin_.follow(from.piece, node);
  pieces_.insert(pieces_.end(), left.begin(), left.end());
}

void FemObject::draw(std::span<const SoftBody> soft) {
  const SoftShape now = shape(soft);
  const std::vector<int> parted = faces_.part([&](int scene_tet) {
    const TetRef at = scene_tets_[scene_tet];
    const Tet& nodes = now.nodes(at);
    std::array<std::uint64_t, 4> ids;
    for (int k = 0; k < 4; ++k) ids[k] = (static_cast<std::uint64_t>(at.piece) << 32) | static_cast<std::uint32_t>(nodes[k]);
    return ids;
  });
  skin_.rebuild(now, faces_, parted);
  torn_.insert(torn_.end(), parted.begin(), parted.end());
}

// Both sides of what is torn.
std::vector<DustParticle> FemObject::take_dust(std::span<const SoftBody> soft, std::uint64_t seed, std::uint64_t step) {
  const SoftShape now = shape(soft);
  std::vector<TornFace> sides;
  for (const int f : torn_) {
    for (int side = 0; side < 2; ++side) {
      const TetRef at = scene_tets_[faces_[f].tet[side]];
      TornFace face;
      for (int k = 0; k < 3; ++k) {
        const NodeRef node{at.piece, now.nodes(at)[kTetFaces[faces_[f].opposite[side]][k]]};
        face.x[k] = now.position(node);
        face.v[k] = now.velocity(node);
      }
      face.density = now.mesh_of(at.piece).rest.material_at(now.material_id(at)).dust;
      sides.push_back(face);
    }
  }
  torn_.clear();
  return dust(sides, scatter(body_seed(seed, id_)) ^ step);
}

namespace {

void push_node(std::span<SoftBody> soft, const Piece& piece, int node, const Vec3& impulse_W) {
  SoftBody& mesh = soft[piece.soft];
  if (piece.is_rigid()) mesh.fragments[piece.fragment].push(impulse_W, node);
  else mesh.push(impulse_W, node);
}

}  // namespace

void FemObject::push(std::span<SoftBody> soft, const Vec3& impulse_W, const Vec3& point_W, double radius) const {
  std::vector<NodeRef> nodes;
  std::vector<double> weights;
  NodeRef nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto weigh = [&](const NodeRef& at, const Vec3& x, double mass, bool held) {
    const double distance = (x - point_W).norm();
    if (distance < least) least = distance, nearest = at;
    if (distance >= radius || held) return;
    const double s = 1 - distance * distance / (radius * radius);
    nodes.push_back(at);
    weights.push_back(mass * s * s);
  };
  for (int p = 0; p < static_cast<int>(pieces_.size()); ++p) {
    const SoftBody& mesh = soft[pieces_[p].soft];
    if (pieces_[p].is_rigid()) {
      const RigidFragment& fragment = mesh.fragments[pieces_[p].fragment];
      for (int n = 0; n < fragment.node_count(); ++n)
        weigh({p, n}, fragment.x()[n], fragment.piece().node_mass[n], fragment.is_held());
    } else {
      for (int n = 0; n < mesh.node_count(); ++n) weigh({p, n}, mesh.state.x[n], mesh.rest.node_mass[n], mesh.fixed[n]);
    }
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (sum <= 0) return push_node(soft, pieces_[nearest.piece], nearest.node, impulse_W);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    push_node(soft, pieces_[nodes[k].piece], nodes[k].node, weights[k] / sum * impulse_W);
}

void FemObject::push_nodes(std::span<SoftBody> soft, const Vec3& impulse_W, std::span<const int> nodes) const {
  const auto mass_of = [&](const NodeRef& at) {
    const Piece& piece = pieces_[at.piece];
    const SoftBody& mesh = soft[piece.soft];
    return piece.is_rigid() ? mesh.fragments[piece.fragment].piece().node_mass[at.node] : mesh.rest.node_mass[at.node];
  };
  double sum = 0;
  for (const int n : nodes) sum += mass_of(scene_nodes_[n]);
  for (const int n : nodes) {
    const NodeRef at = scene_nodes_[n];
    const double share = sum > 0 ? mass_of(at) / sum : 1.0 / static_cast<double>(nodes.size());
    push_node(soft, pieces_[at.piece], at.node, share * impulse_W);
  }
}

double FemObject::mass(std::span<const SoftBody> soft) const {
  double mass = 0;
  for_each_mesh(soft, [&](const SoftBody& mesh) { mass += mesh.mass(); });
  return mass;
}

Vec3 FemObject::centre_of_mass(std::span<const SoftBody> soft) const {
  Vec3 sum = Vec3::Zero();
  for_each_mesh(soft, [&](const SoftBody& mesh) { sum += mesh.mass_moment(); });
  return sum / mass(soft);
}

Vec3 FemObject::momentum(std::span<const SoftBody> soft) const {
  Vec3 sum = Vec3::Zero();
  for_each_mesh(soft, [&](const SoftBody& mesh) { sum += mesh.momentum(); });
  return sum;
}

BodyTopology FemObject::topology(std::span<const SoftBody> soft) const {
  BodyTopology drawn{.id = id_, .name = name_, .model = BodyModel::fem, .deformable = true};
  drawn.colour = colour_;
  drawn.opacity = opacity_;
  drawn.triangles = skin_.triangles();
  drawn.channels = {"stress"};
  BodyFrame frame;
  capture(soft, false, frame);
  drawn.vertices = std::move(frame.positions);
  return drawn;
}

void FemObject::capture(std::span<const SoftBody> soft, bool with_values, BodyFrame& frame) const {
  frame.id = id_;
  frame.pose.p_WB = centre_of_mass(soft);
  frame.positions.clear();
  frame.values.clear();
  std::vector<std::vector<float>> values;
  if (with_values) {
    for (const Piece& piece : pieces_) values.push_back(piece.is_rigid() ? std::vector<float>{} : soft[piece.soft].node_values());
  }
  skin_.capture(shape(soft), values, frame);
}

}  // namespace crumple::sim
