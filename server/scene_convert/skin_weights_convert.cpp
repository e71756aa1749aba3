#include "server/scene_convert/skin_weights_convert.h"

#include "server/sim/example_based/example_set.h"
#include "server/sim/limits.h"

namespace crumple::scene_convert {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Result<Eigen::MatrixXd> from_dense(const v1::DenseWeights& dense, int vertices, int bones, const std::string& field) {
  const std::int64_t size = static_cast<std::int64_t>(vertices) * bones;
  if (dense.values_size() != size)
    return invalid(field + ".values", "has " + std::to_string(dense.values_size()) + " numbers, must have " +
                                          std::to_string(size) + ": bones (" + std::to_string(bones) +
                                          ") times the mesh's nodes (" + std::to_string(vertices) + ")");
  return Eigen::MatrixXd(Eigen::Map<const RowMajor>(dense.values().data(), vertices, bones));
}

Result<void> check_rows(const v1::SparseWeights& sparse, int vertices, const std::string& field) {
  const auto& start = sparse.row_start();
  if (start.size() != vertices + 1)
    return invalid(field + ".row_start", "has " + std::to_string(start.size()) + " entries, must have " +
                                             std::to_string(vertices + 1) + ", one more than the mesh's nodes");
  if (sparse.bone_size() != sparse.weight_size())
    return invalid(field + ".weight", "has " + std::to_string(sparse.weight_size()) + " entries, must have " +
                                          std::to_string(sparse.bone_size()) + " like bone");
  for (int i = 0; i <= vertices; ++i) {
    const int low = i == 0 ? 0 : start[i - 1];
    const bool ends = i < vertices || start[i] == sparse.bone_size();
    if (start[i] < low || start[i] > sparse.bone_size() || (i == 0 && start[0] != 0) || !ends)
      return invalid(field + ".row_start[" + std::to_string(i) + "]",
                     "is " + std::to_string(start[i]) + ", must rise from 0 to the " +
                         std::to_string(sparse.bone_size()) + " entries of bone");
  }
  return {};
}

Result<Eigen::MatrixXd> from_sparse(const v1::SparseWeights& sparse, int vertices, int bones,
                                    const std::string& field) {
  if (auto r = check_rows(sparse, vertices, field); !r) return std::unexpected(r.error());
  Eigen::MatrixXd W = Eigen::MatrixXd::Zero(vertices, bones);
  for (int i = 0; i < vertices; ++i)
    for (int k = sparse.row_start(i), last = -1; k < sparse.row_start(i + 1); last = sparse.bone(k++)) {
      if (sparse.bone(k) <= last || sparse.bone(k) >= bones)
        return invalid(
            field + ".bone[" + std::to_string(k) + "]",
            "is " + std::to_string(sparse.bone(k)) + ", must ascend in its row and be below " + std::to_string(bones));
      W(i, sparse.bone(k)) = sparse.weight(k);
    }
  return W;
}

v1::SparseWeights to_sparse(const Eigen::MatrixXd& W) {
  v1::SparseWeights sparse;
  sparse.add_row_start(0);
  for (int i = 0; i < W.rows(); ++i) {
    for (int b = 0; b < W.cols(); ++b)
      if (W(i, b) != 0) {
        sparse.add_bone(b);
        sparse.add_weight(W(i, b));
      }
    sparse.add_row_start(sparse.bone_size());
  }
  return sparse;
}

}  // namespace

Result<Eigen::MatrixXd> to_weights(const v1::SkinWeights& message, int vertices, const std::string& field) {
  sim::FirstBreach breach;
  breach.number(message.bones(), {1, sim::example_based::kMaxBones}, field + ".bones");
  if (!breach.ok()) return std::unexpected(breach.result().error());
  if (message.has_dense()) return from_dense(message.dense(), vertices, message.bones(), field + ".dense");
  if (message.has_sparse()) return from_sparse(message.sparse(), vertices, message.bones(), field + ".sparse");
  return invalid(field, "is empty, must be dense or sparse");
}

v1::SkinWeights to_message(const Eigen::MatrixXd& W) {
  v1::SkinWeights message;
  message.set_bones(static_cast<int>(W.cols()));
  // a sparse entry takes 9 to 10 bytes, a dense one 8
  if ((W.array() != 0).count() * 10 < W.size() * 8) {
    *message.mutable_sparse() = to_sparse(W);
  } else {
    const RowMajor rows = W;
    message.mutable_dense()->mutable_values()->Add(rows.data(), rows.data() + rows.size());
  }
  return message;
}

}  // namespace crumple::scene_convert
