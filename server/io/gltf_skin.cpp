#include "server/io/gltf_skin.h"

#include "common/text.h"

#include <Eigen/SVD>

#include <map>
#include <set>

namespace crumple::io {
namespace {

using sim::example_based::BoneTransform;
using sim::example_based::Example;

constexpr double kRigid = 1e-3;  // of scale; a float's rounding through a chain of joints is far below

bool is_rigid(const Mat3& linear) {
  return (linear.transpose() * linear - Mat3::Identity()).cwiseAbs().maxCoeff() < 2 * kRigid &&
         linear.determinant() > 0;
}

bool agree(const Eigen::Affine3d& a, const Eigen::Affine3d& b) {
  const double size = std::max(a.matrix().cwiseAbs().maxCoeff(), 1.0);
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() < 1e-4 * size;
}

Eigen::Affine3d bind_to_scene(const GltfSkin& skin, const std::vector<Eigen::Affine3d>& world, bool& posed) {
  const auto carried = [&](std::size_t j) -> Eigen::Affine3d {
    return world[static_cast<std::size_t>(skin.joints[j])] * skin.inverse_bind[j];
  };
  const Eigen::Affine3d first = carried(0);
  bool all_agree = true, all_rigid = true;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    all_agree = all_agree && agree(first, carried(j));
    all_rigid = all_rigid && is_rigid(carried(j).linear());
  }
  posed = !all_agree;
  const bool is_identity =
      (first.matrix() - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff() < 1e-6;  // but for floats' rounding
  return is_identity || (posed && all_rigid) ? Eigen::Affine3d::Identity() : first;
}

Result<GltfSkin> read_skin(const GltfDocument& document, const Json& from, const std::string& where) {
  GltfSkin skin;
  const std::size_t nodes = document.list("nodes").size();
  const Json& joints = GltfDocument::list_of(from, "joints");
  if (joints.empty()) return document.fault(where + ".joints must name at least one node");
  std::set<int> seen;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::int64_t node = joints[j].is_number_unsigned() ? joints[j].get<std::int64_t>() : -1;
    if (node < 0 || node >= static_cast<std::int64_t>(nodes) || !seen.insert(static_cast<int>(node)).second)
      return document.fault(text(where, ".joints[", j, "] names no node, or one twice"));
    skin.joints.push_back(static_cast<int>(node));
  }
  skin.inverse_bind.assign(joints.size(), Eigen::Affine3d::Identity());
  if (!GltfDocument::has(from, "inverseBindMatrices")) return skin;
  const auto matrices = document.accessor(from, "inverseBindMatrices", {16}, where);
  if (!matrices) return std::unexpected(matrices.error());
  if (matrices->cols() < static_cast<Eigen::Index>(joints.size()))
    return document.fault(
        text(where, " has ", matrices->cols(), " inverseBindMatrices, must have ", joints.size(), ", one a joint"));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    skin.inverse_bind[j].matrix() =
        Eigen::Map<const Eigen::Matrix4d>(matrices->col(static_cast<Eigen::Index>(j)).data());
    skin.inverse_bind[j].makeAffine();
    if (!(std::abs(skin.inverse_bind[j].linear().determinant()) > 1e-12))
      return document.fault(text(where, ".inverseBindMatrices[", j, "] cannot be inverted"));
  }
  return skin;
}

std::string unique_name(std::string name, const std::vector<sim::example_based::Handle>& handles) {
  const auto taken = [&](const std::string& wanted) {
    return std::ranges::any_of(handles, [&](const auto& handle) { return handle.name == wanted; });
  };
  if (name.size() > 200) name.resize(200);
  std::string wanted = name;
  for (int k = 2; taken(wanted); ++k) wanted = text(name, "_", k);
  return wanted;
}

// Applies the first keys of one animation to the nodes' transforms.
Result<void> apply_first_keys(const GltfDocument& document, const Json& animation, const std::string& where,
                              std::vector<GltfTransform>& local) {
  const Json& channels = GltfDocument::list_of(animation, "channels");
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const Json& target = GltfDocument::object_of(channels[c], "target");
    const std::string at = text(where, ".channels[", c, "]");
    if (!target.contains("node") || !target.contains("path") || !target["path"].is_string())
      continue;  // extensions' targets
    const std::string path = target["path"].get<std::string>();
    if (path != "translation" && path != "rotation" && path != "scale") continue;
    const auto node = document.index(target, "node", local.size(), at + ".target");
    if (!node) return std::unexpected(node.error());
    const auto key = first_key(document, animation, channels[c], at, path == "rotation" ? 4 : 3, 1);
    if (!key) return std::unexpected(key.error());
    GltfTransform& transform = local[static_cast<std::size_t>(*node)];
    transform.given_as_matrix = false;
    if (path == "translation") transform.translation = *key;
    if (path == "scale") transform.scale = *key;
    if (path == "rotation") {
      if (!(key->norm() > 1e-6)) return document.fault(at + " begins with a rotation of no length");
      transform.rotation = Quat((*key)(3), (*key)(0), (*key)(1), (*key)(2)).normalized();
    }
  }
  return {};
}

// Rotation and translation of a joint's transform; what is left of it is scale and shear.
BoneTransform nearest_rigid(const Eigen::Affine3d& T, const Vec3& pivot) {
  const Eigen::JacobiSVD<Mat3> svd(T.linear(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Mat3 R = svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  return {Quat(R).normalized(), T * pivot - R * pivot};
}

std::string scale_of(const Mat3& linear) {
  const Eigen::JacobiSVD<Mat3> svd(linear);
  return text(svd.singularValues()[0], " x ", svd.singularValues()[1], " x ", svd.singularValues()[2],
              linear.determinant() < 0 ? ", mirrored" : "");
}

bool moves_nothing(const Example& pose, const std::vector<sim::example_based::Handle>& handles) {
  double size = 1e-6;
  for (const auto& handle : handles) size = std::max(size, handle.position.cwiseAbs().maxCoeff());
  for (std::size_t b = 0; b < pose.bones.size(); ++b) {
    const BoneTransform& T = pose.bones[b];
    if (T.q.angularDistance(Quat::Identity()) > 1e-5) return false;
    if ((T.q * handles[b].position + T.t - handles[b].position).norm() > 1e-5 * size) return false;
  }
  return true;
}

}  // namespace

Result<GltfSkins> read_skins(const GltfDocument& document, const std::vector<Eigen::Affine3d>& world,
                             std::vector<std::string>& warnings) {
  GltfSkins out;
  const Json& skins = document.list("skins");
  std::map<int, int> handle_of_node;
  for (std::size_t s = 0; s < skins.size(); ++s) {
    auto skin = read_skin(document, skins[s], text("skins[", s, "]"));
    if (!skin) return std::unexpected(skin.error());
    bool posed = false;
    skin->bind_to_scene = bind_to_scene(*skin, world, posed);
    if (posed)
      warnings.push_back(
          text("skins[", s, "]: its joints stand in a pose; the rest shape is what the inverse bind matrices say"));
    for (std::size_t j = 0; j < skin->joints.size(); ++j) {
      const int node = skin->joints[j];
      const auto [at, is_new] = handle_of_node.try_emplace(node, static_cast<int>(out.handles.size()));
      skin->handle.push_back(at->second);
      const Vec3 position = skin->bind_to_scene * (skin->inverse_bind[j].inverse() * Vec3(Vec3::Zero()));
      if (!position.allFinite() || position.cwiseAbs().maxCoeff() > 1e6)
        return document.fault(text("skins[", s, "].joints[", j, "] rests farther than 1e6 m from the origin"));
      const std::string name =
          GltfDocument::name_of(document.list("nodes")[static_cast<std::size_t>(node)], text("joint ", node));
      if (is_new)
        out.handles.push_back({unique_name(name, out.handles), position});
      else if ((out.handles[at->second].position - position).norm() > 1e-4 * (1 + position.norm()))
        warnings.push_back(
            text("joint \"", name, "\" rests elsewhere in skins[", s, "]; the first skin's place is taken"));
    }
    out.skins.push_back(*std::move(skin));
  }
  if (out.handles.size() > static_cast<std::size_t>(sim::example_based::kMaxBones))
    return document.fault(
        text("has ", out.handles.size(), " joints, must have at most ", sim::example_based::kMaxBones));
  const std::vector<int> parents = node_parents(document);
  out.parents.assign(out.handles.size(), -1);
  for (const auto& [node, handle] : handle_of_node)
    for (int above = parents[node]; above >= 0 && out.parents[handle] < 0; above = parents[above])
      if (const auto at = handle_of_node.find(above); at != handle_of_node.end()) out.parents[handle] = at->second;
  return out;
}

Result<Eigen::MatrixXd> first_key(const GltfDocument& document, const Json& animation, const Json& channel,
                                  const std::string& where, int width, int items) {
  const Json& samplers = GltfDocument::list_of(animation, "samplers");
  const auto at = document.index(channel, "sampler", samplers.size(), where);
  if (!at) return std::unexpected(at.error());
  const Json& sampler = samplers[static_cast<std::size_t>(*at)];
  const auto output = document.accessor(sampler, "output", {width}, where + ".sampler");
  if (!output) return std::unexpected(output.error());
  // A spline's key is its tangent before, its value and its tangent after.
  const bool spline = GltfDocument::has(sampler, "interpolation") && sampler["interpolation"] == "CUBICSPLINE";
  const Eigen::Index first = spline ? items : 0;
  if (output->cols() < first + items) return document.fault(text(where, " has no key"));
  return Eigen::MatrixXd(output->middleCols(first, items));
}

Result<std::vector<Example>> read_poses(const GltfDocument& document, const GltfSkins& skins,
                                        const std::vector<GltfTransform>& local, ScaledJoints scaled,
                                        std::vector<std::string>& warnings) {
  std::vector<Example> poses;
  if (skins.handles.empty()) return poses;
  const std::vector<int> parents = node_parents(document);
  const Json& animations = document.list("animations");
  for (std::size_t a = 0; a < animations.size(); ++a) {
    Example pose{GltfDocument::name_of(animations[a], text("animation ", a)),
                 std::vector<BoneTransform>(skins.handles.size())};
    auto posed = local;
    if (auto applied = apply_first_keys(document, animations[a], text("animations[", a, "]"), posed); !applied)
      return std::unexpected(applied.error());
    const auto world = world_transforms(posed, parents);
    std::vector<char> done(skins.handles.size(), false);
    for (const GltfSkin& skin : skins.skins)
      for (std::size_t j = 0; j < skin.joints.size(); ++j) {
        const int handle = skin.handle[j];
        if (std::exchange(done[static_cast<std::size_t>(handle)], true)) continue;
        const Eigen::Affine3d T =
            world[static_cast<std::size_t>(skin.joints[j])] * skin.inverse_bind[j] * skin.bind_to_scene.inverse();
        if (!is_rigid(T.linear())) {
          const std::string what = text("animation \"", pose.name, "\" scales or shears joint \"",
                                        skins.handles[handle].name, "\" by ", scale_of(T.linear()));
          if (scaled == ScaledJoints::reject || !T.linear().allFinite())
            return document.fault(what + ", must only turn and move it");
          warnings.push_back(what + "; its nearest rotation is taken");
        }
        pose.bones[static_cast<std::size_t>(handle)] = nearest_rigid(T, skins.handles[handle].position);
      }
    if (moves_nothing(pose, skins.handles))
      warnings.push_back("animation \"" + pose.name + "\" moves no joint and is no example");
    else
      poses.push_back(std::move(pose));
  }
  return poses;
}

}  // namespace crumple::io
