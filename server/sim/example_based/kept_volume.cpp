#include "server/sim/example_based/kept_volume.h"

#include "server/sim/example_based/application.h"
#include "server/sim/example_based/skinning.h"

#include <algorithm>
#include <cmath>

namespace crumple::sim::example_based {
namespace {

constexpr int kChunk = 64;           // rows a task
constexpr double kNone = 1e-12;      // of a volume or a slope
constexpr double kNothingLeft = 1e-3;  // an example with less weight than this, on the rows that change, cannot give any

// dV / dx_i [m^2]: a third of the area vectors opposite.
std::vector<Vec3> volume_gradient(const ExampleRest& rest, std::span<const Vec3> x) {
  std::vector<Vec3> gradient(x.size(), Vec3::Zero());
  const TetMesh& mesh = rest.set->mesh;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto& [a, b, c, d] = mesh.tets[t];
    const double w = fill_of(mesh, t) / 6;
    const Vec3 ab = x[b] - x[a], ac = x[c] - x[a], ad = x[d] - x[a];
    const Vec3 gb = w * ac.cross(ad), gc = w * ad.cross(ab), gd = w * ab.cross(ac);
    gradient[b] += gb;
    gradient[c] += gc;
    gradient[d] += gd;
    gradient[a] -= gb + gc + gd;
  }
  return gradient;
}

// The part of H with sum 0, orthogonal to A, and not below 0 where `empty`.
WeightRow allowed_part(const WeightRow& H, const WeightRow& A, const std::vector<char>& empty) {
  const int examples = static_cast<int>(H.size());
  std::vector<char> out(examples, 0);
  for (;;) {
    double count = 0, mean_H = 0, mean_A = 0;
    for (int e = 0; e < examples; ++e)
      if (!out[e]) count += 1, mean_H += H[e], mean_A += A[e];
    WeightRow d = WeightRow::Zero(examples), a = WeightRow::Zero(examples);
    if (count < 2) return d;
    for (int e = 0; e < examples; ++e)
      if (!out[e]) d[e] = H[e] - mean_H / count, a[e] = A[e] - mean_A / count;
    if (const double squared = a.squaredNorm(); squared > 0) d -= d.dot(a) / squared * a;
    bool again = false;
    for (int e = 0; e < examples; ++e)
      if (!out[e] && empty[e] && d[e] < 0) out[e] = again = true;
    if (!again) return d;
  }
}

}  // namespace

void RowsBefore::keep(const ExampleState& state, std::span<const int> which) {
  vertices.assign(which.begin(), which.end());
  E.clear();
  x.clear();
  for (const int i : which) {
    const double* row = state.E.row(i).data();
    E.insert(E.end(), row, row + state.E.cols());
    x.push_back(state.x[i]);
  }
}

bool give_back_volume(const ExampleRest& rest, const RowsBefore& before, const ThreadPool& pool, ExampleState& state) {
  const int examples = rest.example_count();
  const int rows = static_cast<int>(before.vertices.size());
  const double missing = rest.shape_volume - shape_volume(rest.set->mesh, state.x);
  if (rows == 0 || !(std::abs(missing) > kNone * rest.shape_volume)) return false;

  const std::vector<Vec3> gradient = volume_gradient(rest, state.x);
  struct Part {
    double phi = 0;
    WeightRow H, A;  // phi J^T dV/dx, phi J^T u
  };
  std::vector<Part> parts(rows);
  pool.for_chunks(rows, kChunk, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = before.vertices[k];
      const WeightRow row = state.E.row(i).transpose();
      const Eigen::Map<const Eigen::VectorXd> old(before.E.data() + static_cast<std::ptrdiff_t>(k) * examples, examples);
      Part& part = parts[k];
      part.phi = (row - old).norm();
      const Jacobian J = skinning_jacobian(rest, i, row);
      part.H = part.phi * (J.transpose() * gradient[i]);
      part.A = part.phi * (J.transpose() * (state.x[i] - before.x[k]));
    }
  });
  WeightRow H = WeightRow::Zero(examples), A = WeightRow::Zero(examples), weight = WeightRow::Zero(examples);
  double phi = 0;
  for (int k = 0; k < rows; ++k) {
    H += parts[k].H;
    A += parts[k].A;
    weight += parts[k].phi * state.E.row(before.vertices[k]).transpose();
    phi += parts[k].phi;
  }
  if (!(phi > 0)) return false;
  std::vector<char> empty(examples);
  for (int e = 0; e < examples; ++e) empty[e] = weight[e] < kNothingLeft * phi;
  WeightRow d = allowed_part(missing > 0 ? H : WeightRow(-H), A, empty);
  const double slope = std::abs(H.dot(d));  // [m^3] a unit
  if (!(slope > kNone * H.squaredNorm()) || !std::isfinite(slope)) return false;
  d *= std::min(std::abs(missing) / slope, kMostBulge / d.norm());
  for (int k = 0; k < rows; ++k) {
    const int i = before.vertices[k];
    state.E.row(i) += parts[k].phi * d.transpose();
    normalise_row(state.E, i);
  }
  return true;
}

}  // namespace crumple::sim::example_based
