#include "server/sim/example_based/example_set.h"

#include <cmath>
#include <sstream>

namespace crumple::sim::example_based {
namespace {

constexpr double kWeightSlack = 1e-9;  // what a text file's rounding may do to a weight of 0 or 1
constexpr double kRowSumSlack = 1e-6;
constexpr double kMinQuaternion = 1e-6;

// "has ", 3, " rows" -> "has 3 rows"; nine digits show a row sum that is off by 1e-6.
template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  out.precision(9);
  (out << ... << parts);
  return out.str();
}

std::string indexed(const std::string& field, const char* name, std::size_t i) {
  return text(field, ".", name, "[", i, "]");
}

Result<void> validate_weights(const ExampleSet& set, const std::string& field) {
  const Eigen::MatrixXd& W = set.W;
  if (W.rows() != set.vertex_count())
    return invalid(field, text("has ", W.rows(), " rows, must have ", set.vertex_count(), ", one a vertex"));
  if (W.cols() < 1 || W.cols() > kMaxBones)
    return invalid(field, text("has ", W.cols(), " bones, must have 1 to ", kMaxBones));
  for (int i = 0; i < W.rows(); ++i) {
    double sum = 0;
    for (int b = 0; b < W.cols(); ++b) {
      const double w = W(i, b);
      if (!(w >= -kWeightSlack && w <= 1 + kWeightSlack))  // so written, it catches NaN too
        return invalid(text(field, "[", i, "][", b, "]"), text("is ", w, ", must be in [0, 1]"));
      sum += w;
    }
    if (std::abs(sum - 1) > kRowSumSlack)
      return invalid(text(field, "[", i, "]"), text("sums to ", sum, ", must sum to 1 within 1e-6"));
  }
  return {};
}

Result<void> validate_example(const Example& example, int bones, const std::string& field) {
  if (static_cast<int>(example.bones.size()) != bones)
    return invalid(field + ".bones",
                   text("has ", example.bones.size(), " transforms, must have ", bones, ", one a column of W"));
  for (std::size_t b = 0; b < example.bones.size(); ++b) {
    const BoneTransform& T = example.bones[b];
    if (!T.t.allFinite()) return invalid(indexed(field, "bones", b) + ".t", "is not finite");
    if (!T.q.coeffs().allFinite()) return invalid(indexed(field, "bones", b) + ".q", "is not finite");
    if (!(T.q.norm() >= kMinQuaternion))
      return invalid(indexed(field, "bones", b) + ".q",
                     text("has norm ", T.q.norm(), ", must be at least 1e-6 to name a rotation"));
  }
  return {};
}

Result<void> validate_part(const std::vector<int>& part, int vertices, const std::string& field) {
  if (part.size() < 4) return invalid(field, text("has ", part.size(), " vertices, must have at least 4"));
  for (std::size_t k = 0; k < part.size(); ++k)
    if (part[k] < 0 || part[k] >= vertices)
      return invalid(text(field, "[", k, "]"), text("is ", part[k], ", must be in [0, ", vertices, ")"));
  return {};
}

Result<void> validate_handles(const ExampleSet& set, const std::string& field) {
  if (!set.handles.empty() && static_cast<int>(set.handles.size()) != set.bone_count())
    return invalid(field, text("has ", set.handles.size(), " handles, must have ", set.bone_count(), ", one a bone, or none"));
  for (std::size_t b = 0; b < set.handles.size(); ++b)
    if (!set.handles[b].position.allFinite()) return invalid(text(field, "[", b, "].position"), "is not finite");
  return {};
}

Result<void> validate_scale(const std::vector<double>& scale, int vertices, const std::string& field) {
  if (!scale.empty() && static_cast<int>(scale.size()) != vertices)
    return invalid(field, text("has ", scale.size(), " numbers, must have ", vertices, ", one a vertex, or none"));
  for (std::size_t i = 0; i < scale.size(); ++i)
    if (!(scale[i] >= 0 && scale[i] <= kMaxRegionScale))
      return invalid(text(field, "[", i, "]"), text("is ", scale[i], ", must be in [0, ", kMaxRegionScale, "]"));
  return {};
}

}  // namespace

Result<void> validate(const ExampleSet& set, const std::string& field) {
  if (auto ok = validate(set.mesh, field + ".mesh"); !ok) return ok;
  if (auto ok = validate_weights(set, field + ".W"); !ok) return ok;
  if (set.examples.empty()) return invalid(field + ".examples", "is empty, must begin with the rest pose");
  if (set.example_count() > kMaxExamples)
    return invalid(field + ".examples", text("has ", set.example_count(), " poses, must have at most ", kMaxExamples));
  for (std::size_t e = 0; e < set.examples.size(); ++e)
    if (auto ok = validate_example(set.examples[e], set.bone_count(), indexed(field, "examples", e)); !ok) return ok;
  if (set.convex_parts.empty()) return invalid(field + ".convex_parts", "is empty, must have at least one part");
  for (std::size_t p = 0; p < set.convex_parts.size(); ++p)
    if (auto ok = validate_part(set.convex_parts[p], set.vertex_count(), indexed(field, "convex_parts", p)); !ok)
      return ok;
  if (auto ok = validate_handles(set, field + ".handles"); !ok) return ok;
  if (auto ok = validate_scale(set.alpha_scale, set.vertex_count(), field + ".alpha_scale"); !ok) return ok;
  if (auto ok = validate_scale(set.beta_scale, set.vertex_count(), field + ".beta_scale"); !ok) return ok;
  if (!set.render.vertices.empty() || !set.render.triangles.empty()) return validate(set.render, field + ".render");
  return {};
}

}  // namespace crumple::sim::example_based
