#include "server/sim/example_based/skinning.h"

#include <array>
#include <algorithm>
#include <cassert>

namespace crumple::sim::example_based {
namespace {

constexpr int kChunk = 64;          // vertices a task: some 50 us of work
constexpr int kLinearChunk = 1024;  // the same where eq. 3 is linear: some 10 us

// The examples that take part in a row: few, however many there are.
struct Support {
  int count = 0;
  std::array<int, kMaxExamples> example;
  std::array<double, kMaxExamples> weight;

  explicit Support(const WeightRow& row) {
    for (int e = 0; e < row.size(); ++e)
      if (row[e] != 0) {
        example[count] = e;
        weight[count++] = row[e];
      }
  }
  bool is_rest() const { return count == 1 && example[0] == 0 && weight[0] == 1; }
};

struct Blend {
  Vec4 Q;  // not guarded
  Vec4 t;
};

Blend blend(const BonePose* poses, const Support& support) {
  Blend sum{Vec4::Zero(), Vec4::Zero()};
  for (int k = 0; k < support.count; ++k) {
    sum.Q += support.weight[k] * poses[support.example[k]].q;
    sum.t += support.weight[k] * poses[support.example[k]].t;
  }
  return sum;
}

std::span<const BoneWeight> weights_of(const ExampleRest& rest, int i) {
  return std::span(rest.weights).subspan(rest.weight_start[i], rest.weight_start[i + 1] - rest.weight_start[i]);
}

// Eq. 3. The rotations of all bones are summed into one symmetric matrix before they meet u:
//   S = sum_b 2 W_ib Q Q^T / |Q|^2 = [M a; a^T .],   sum_b W_ib R(Q / |Q|) u = u + a x u + M u - tr(M) u
// which is sum_b W_ib `rotate`(Q, u) for weights that sum to 1. Four wide throughout, and u itself where no bone turns.
Vec3 skin_supported(const ExampleRest& rest, int i, const Support& support) {
  Eigen::Matrix4d S = Eigen::Matrix4d::Zero();
  Vec4 t = Vec4::Zero();
  for (const auto& [bone, weight] : weights_of(rest, i)) {
    const BonePose* poses = &rest.pose(bone, 0);
    const Blend T = blend(poses, support);
    const Vec4 Q = rest.turns[bone] ? guarded(T.Q, poses[0].q) : poses[0].q;
    S.noalias() += Q * (2 * weight / Q.squaredNorm() * Q).transpose();
    t += weight * T.t;
  }
  const Vec3& u = rest.set->mesh.X[i];
  const Mat3 M = S.topLeftCorner<3, 3>();
  const Vec3 a = S.topRightCorner<3, 1>();
  return u + a.cross(u) + M * u - M.trace() * u + t.head<3>();
}

// Eq. 3 where it is linear in E.
Vec3 skin_linear(const ExampleRest& rest, int i, const double* row) {
  const int examples = rest.example_count();
  const Vec4* D = &rest.basis[static_cast<std::size_t>(i) * examples];
  Vec4 moved = Vec4::Zero();
  for (int e = rest.first_example; e < examples; ++e) moved += row[e] * D[e];
  return rest.turned_u[i] + moved.head<3>();
}

}  // namespace

Vec3 skin_vertex(const ExampleRest& rest, int i, const WeightRow& row) {
  assert(row.size() == rest.example_count());
  if (rest.linear) return skin_linear(rest, i, row.data());
  const Support support(row);
  return support.is_rest() ? rest.x_rest[i] : skin_supported(rest, i, support);
}

Vec3 skin_in_example(const ExampleRest& rest, int i, int e) {
  if (rest.linear) return rest.turned_u[i] + rest.basis[static_cast<std::size_t>(i) * rest.example_count() + e].head<3>();
  return skin_supported(rest, i, Support(WeightRow::Unit(rest.example_count(), e)));
}

bool skin(const ExampleRest& rest, const WeightMatrix& E, std::span<const int> vertices, const ThreadPool& pool,
          std::span<Vec3> x) {
  assert(static_cast<int>(x.size()) == rest.vertex_count() && E.rows() == rest.vertex_count());
  const int count = static_cast<int>(vertices.size());
  const int chunk = rest.linear ? kLinearChunk : kChunk;
  std::vector<char> moved((count + chunk - 1) / chunk, 0);  // one a chunk
  pool.for_chunks(count, chunk, [&](int begin, int end) {
    bool any = false;
    for (int k = begin; k < end; ++k) {
      const int i = vertices[k];
      const Vec3 skinned =
          rest.linear ? skin_linear(rest, i, E.row(i).data()) : skin_vertex(rest, i, E.row(i).transpose());
      any |= skinned != x[i];
      x[i] = skinned;
    }
    moved[begin / chunk] = any;
  });
  return std::ranges::find(moved, 1) != moved.end();
}

Jacobian skinning_jacobian(const ExampleRest& rest, int i, const WeightRow& row) {
  assert(row.size() == rest.example_count());
  const int examples = rest.example_count();
  if (rest.linear) {
    using Block = Eigen::Map<const Eigen::Matrix<double, 4, Eigen::Dynamic>>;
    return Block(rest.basis[static_cast<std::size_t>(i) * examples].data(), 4, examples).topRows<3>();
  }
  const Support support(row);
  const Vec3& u = rest.set->mesh.X[i];
  Jacobian J = Jacobian::Zero(3, examples);
  for (const auto& [bone, weight] : weights_of(rest, i)) {
    const BonePose* poses = &rest.pose(bone, 0);
    const Vec4& q_rest = poses[0].q;
    const Vec4 Q = blend(poses, support).Q;
    const Vec4 Q_guarded = guarded(Q, q_rest);
    for (int e = 0; e < examples; ++e) {
      Vec3 dx = poses[e].t.head<3>();
      if (rest.turns[bone]) dx += rotate_derivative(Q_guarded, guarded_derivative(Q, q_rest, poses[e].q), u);
      J.col(e) += weight * dx;
    }
  }
  return J;
}

}  // namespace crumple::sim::example_based
