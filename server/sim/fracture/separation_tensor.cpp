#include "server/sim/fracture/separation_tensor.h"

#include "server/sim/fem/tensile_part.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <type_traits>

namespace crumple::sim::fracture {

namespace {

constexpr int kChunk = 256;

int local_index(const Tet& tet, int node) {
  for (int k = 0; k < 3; ++k)
    if (tet[k] == node) return k;
  assert(tet[3] == node);
  return 3;
}

struct AllLoose {
  bool operator()(int) const { return true; }
};

// S of one node, whose tets that are not `loose` count as one piece.
template <class Loose>
Mat3 tensor_at(int node, const std::vector<Tet>& tets, const NodeStars& stars, const PartForces& forces, Loose loose) {
  Vec3 F_plus = Vec3::Zero(), F_minus = Vec3::Zero(), piece_plus = Vec3::Zero(), piece_minus = Vec3::Zero();
  Mat3 sum = Mat3::Zero();
  for (const int t : stars[node]) {
    const int k = local_index(tets[t], node);
    const Vec3 f_plus = forces.tensile[t].col(k), f_minus = forces.compressive[t].col(k);
    F_plus += f_plus;
    F_minus += f_minus;
    if (loose(t)) {
      sum += outer_by_length(f_plus) - outer_by_length(f_minus);
    } else {
      piece_plus += f_plus;
      piece_minus += f_minus;
    }
  }
  sum += outer_by_length(piece_plus) - outer_by_length(piece_minus);
  return 0.5 * (sum - outer_by_length(F_plus) + outer_by_length(F_minus));
}

template <class Loose>
double cut_area_at(int node, const Vec3& e, const std::vector<Tet>& tets, const NodeStars& stars,
                   std::span<const Mat34> normals, Loose loose) {
  double sum = 0, piece = 0;
  for (const int t : stars[node]) {
    const double projected = normals[t].col(local_index(tets[t], node)).dot(e);
    if (loose(t))
      sum += std::abs(projected);
    else
      piece += projected;
  }
  return (sum + std::abs(piece)) / 6;
}

void part_forces(int t, const Mat3& tensile, const Mat3& stress, const Mat34& normals, PartForces& forces) {
  forces.tensile[t] = tensile * normals / 3;
  forces.compressive[t] = (stress - tensile) * normals / 3;
}

// Of the positive eigenvalues of S the strongest; strength 0 if there is none. area(e): what to divide by.
template <class Area>
SplitCandidate strongest(int node, const Mat3& S, Area area_across) {
  SplitCandidate best{.node = node};
  if (!S.allFinite()) return best;
  // The closed form takes 180 ns, iterations 480. It is exact to 1e-14 of |S|, where two eigenvalues nearly coincide to 1e-8: far
  // below what a toughness is known to.
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(S);
  for (int i = 2; i >= 0; --i) {  // ascending; the largest may be beaten once areas count
    const double eigenvalue = eigen.eigenvalues()[i];
    if (!(eigenvalue > 0)) break;
    const Vec3 e = eigen.eigenvectors().col(i);
    const double area = area_across(e);
    const double strength = area > 0 ? eigenvalue / area : 0;
    if (strength > best.strength) best = {.node = node, .normal = e, .strength = strength, .area = area};
  }
  return best;
}

// The toughnesses of a node's tets, ascending and without infinity. True if all of its tets have the same.
bool list_levels(std::span<const int> star, const Toughness& toughness, std::vector<double>& levels) {
  levels.clear();
  for (const int t : star)
    if (std::ranges::find(levels, toughness.of(t)) == levels.end()) levels.push_back(toughness.of(t));
  const bool alone = levels.size() < 2;
  std::erase(levels, std::numeric_limits<double>::infinity());
  std::ranges::sort(levels);
  return alone;
}

// What one node would break by. tensor(node, loose): its S. levels: scratch.
template <class Tensor>
SplitCandidate candidate_at(int node, Tensor tensor, const std::vector<Tet>& tets, const NodeStars& stars,
                            std::span<const Mat34> normals, const Toughness& toughness, std::vector<double>& levels) {
  const auto look = [&](double level, auto loose) {
    SplitCandidate found = strongest(node, tensor(node, loose), [&](const Vec3& e) {
      return toughness.raw ? 1 : cut_area_at(node, e, tets, stars, normals, loose);
    });
    found.toughness = level;
    return found;
  };
  if (toughness.same_everywhere()) return look(toughness.of_material[0], AllLoose{});
  const bool alone = list_levels(stars[node], toughness, levels);
  SplitCandidate candidate{.node = node};
  for (const double level : levels) {
    candidate = alone ? look(level, AllLoose{}) : look(level, [&](int t) { return toughness.of(t) <= level; });
    if (candidate.breaks()) break;
  }
  return candidate;
}

}  // namespace

Mat3 outer_by_length(const Vec3& a) {
  const double length = a.norm();
  if (length == 0) return Mat3::Zero();
  return a * (a / length).transpose();
}

void set_part_forces(int t, const Mat3& stress, const Mat34& normals, PartForces& forces) {
  part_forces(t, fem::tensile_part(stress), stress, normals, forces);
}

void separation_tensors(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat3> stress,
                        std::span<const Mat34> normals, const ThreadPool& pool, PartForces& forces,
                        std::span<Mat3> S) {
  assert(stress.size() == tets.size() && normals.size() == tets.size());
  assert(static_cast<int>(S.size()) == stars.node_count());
  forces.tensile.resize(tets.size());
  forces.compressive.resize(tets.size());
  const auto of_tets = [&](int begin, int end) {
    std::array<Mat3, 4> tensile;
    int t = begin;
    for (; t + 4 <= end; t += 4) {
      fem::store(fem::tensile_parts(fem::load(&stress[t])), tensile.data());
      for (int k = 0; k < 4; ++k) part_forces(t + k, tensile[k], stress[t + k], normals[t + k], forces);
    }
    for (; t < end; ++t) set_part_forces(t, stress[t], normals[t], forces);
  };
  pool.for_chunks(static_cast<int>(tets.size()), kChunk, std::cref(of_tets));
  const auto of_nodes = [&](int begin, int end) {
    for (int node = begin; node < end; ++node) S[node] = separation_tensor(node, tets, stars, forces);
  };
  pool.for_chunks(stars.node_count(), kChunk, std::cref(of_nodes));
}

Mat3 separation_tensor(int node, const std::vector<Tet>& tets, const NodeStars& stars, const PartForces& forces) {
  return tensor_at(node, tets, stars, forces, AllLoose{});
}

double cut_area(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat34> normals, int node,
                const Vec3& e) {
  return cut_area_at(node, e, tets, stars, normals, AllLoose{});
}

std::vector<SplitCandidate> split_candidates(const std::vector<Tet>& tets, const NodeStars& stars,
                                             std::span<const Mat34> normals, std::span<const Mat3> S,
                                             double toughness, bool raw_toughness, const ThreadPool& pool) {
  assert(toughness >= 0);
  const Toughness everywhere{.of_material = {toughness}, .material_id = {}, .raw = raw_toughness};
  return split_candidates(tets, stars, normals, {}, S, everywhere, pool);
}

std::vector<SplitCandidate> split_candidates(const std::vector<Tet>& tets, const NodeStars& stars,
                                             std::span<const Mat34> normals, const PartForces& forces,
                                             std::span<const Mat3> S, const Toughness& toughness,
                                             const ThreadPool& pool) {
  std::vector<SplitCandidate> candidates;
  split_candidates(tets, stars, normals, forces, S, toughness, pool, candidates);
  return candidates;
}

void split_candidates(const std::vector<Tet>& tets, const NodeStars& stars, std::span<const Mat34> normals,
                      const PartForces& forces, std::span<const Mat3> S, const Toughness& toughness, const ThreadPool& pool,
                      std::vector<SplitCandidate>& candidates) {
  candidates.assign(S.size(), {});
  const auto tensor = [&]<class Loose>(int node, Loose loose) {
    if constexpr (std::is_same_v<Loose, AllLoose>) return S[node];
    else return tensor_at(node, tets, stars, forces, loose);
  };
  const auto of_nodes = [&](int begin, int end) {
    thread_local std::vector<double> levels;
    for (int node = begin; node < end; ++node)
      candidates[node] = candidate_at(node, tensor, tets, stars, normals, toughness, levels);
  };
  pool.for_chunks(static_cast<int>(S.size()), kChunk, std::cref(of_nodes));
  std::erase_if(candidates, [](const SplitCandidate& c) { return !c.breaks(); });
}

SplitCandidate split_candidate(int node, const std::vector<Tet>& tets, const NodeStars& stars,
                               std::span<const Mat34> normals, const PartForces& forces, const Toughness& toughness,
                               const Mat3& residual) {
  const auto tensor = [&](int of, auto loose) -> Mat3 { return tensor_at(of, tets, stars, forces, loose) + residual; };
  std::vector<double> levels;
  return candidate_at(node, tensor, tets, stars, normals, toughness, levels);
}

}  // namespace crumple::sim::fracture
