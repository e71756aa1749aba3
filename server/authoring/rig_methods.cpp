#include "server/authoring/rig_methods.h"

#include "server/authoring/handle_placement.h"
#include "server/authoring/handle_weights.h"
#include "server/authoring/pose_fit.h"

#include <algorithm>
#include <cmath>

namespace crumple::authoring {
namespace {

using sim::example_based::BoneTransform;
using sim::example_based::Example;
using sim::example_based::ExampleSet;

std::vector<Vec3> place_beside(const sim::TetMesh& mesh, const std::vector<int>& surface, std::span<const Vec3> given,
                               int count) {
  if (count <= 0) return {};
  std::vector<Vec3> placed = points_of(mesh, place_handles(mesh, surface, count + static_cast<int>(given.size())));
  for (const Vec3& p : given) {
    if (static_cast<int>(placed.size()) <= count) break;
    placed.erase(std::ranges::min_element(placed, {}, [&](const Vec3& q) { return (q - p).squaredNorm(); }));
  }
  return placed;
}

double residual(const ExampleSet& set, const Example& pose, const std::function<Vec3(const Vec3&)>& field) {
  const std::vector<Vec3> x = skinned(set, pose.bones);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - set.mesh.X[i] - field(set.mesh.X[i])).squaredNorm();
  return sum;
}

Example fit(const std::string& name, const ExampleSet& set, std::span<const Vec3> handles, const PoseField& field) {
  Example moved = fit_example(name, set.W, set.mesh.X, handles, field, BoneRotations::none);
  Example turned = fit_example(name, set.W, set.mesh.X, handles, field, BoneRotations::follow_field);
  return residual(set, turned, field) < residual(set, moved, field) ? turned : moved;
}

std::vector<BoneTransform> complete(const ExampleSet&, std::span<const Vec3> handles, const PartialPose& pose) {
  std::vector<BoneTransform> out(handles.size());
  std::vector<int> named;
  std::vector<Vec3> places;
  for (std::size_t b = 0; b < pose.size(); ++b)
    if (pose[b]) named.push_back(static_cast<int>(b)), places.push_back(handles[b]), out[b] = *pose[b];
  if (named.empty()) return out;
  const Eigen::MatrixXd W = handle_weights(handles, places);
  for (std::size_t b = 0; b < pose.size(); ++b) {
    if (pose[b]) continue;
    Eigen::Vector4d q = Eigen::Vector4d::Zero();
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < named.size(); ++k) {
      const BoneTransform& T = *pose[static_cast<std::size_t>(named[k])];
      const double w = W(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(k));
      q += w * (T.q.w() < 0 ? -1.0 : 1.0) * T.q.coeffs();
      place += w * (T.q * handles[b] + T.t);
    }
    out[b].q = q.norm() > 1e-6 ? Quat(q).normalized() : Quat::Identity();
    out[b].t = place - out[b].q * handles[b];
  }
  return out;
}

}  // namespace

std::vector<Vec3> skinned(const ExampleSet& set, const std::vector<BoneTransform>& T) {
  std::vector<Vec3> x(set.mesh.X.size(), Vec3::Zero());
  std::vector<Mat3> R;
  for (const BoneTransform& bone : T) R.push_back(bone.q.normalized().toRotationMatrix());
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t b = 0; b < T.size(); ++b)
      if (const double w = set.W(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(b)); w != 0)
        x[i] += w * (R[b] * set.mesh.X[i] + T[b].t);
  return x;
}

RigMethods default_rig_methods() {
  return {[](const sim::TetMesh& mesh, std::span<const Vec3> handles) -> Result<Eigen::MatrixXd> {
            return handle_weights(mesh.X, handles);
          },
          place_beside, fit, complete};
}

}  // namespace crumple::authoring
