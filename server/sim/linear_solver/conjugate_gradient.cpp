#include "server/sim/linear_solver/conjugate_gradient.h"

#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace crumple::sim::linear_solver {

namespace {

// Every loop over vectors has the same chunks, which threads share out as they do a product's rows: a thread finds in its cache what it
// wrote in the loop before.
constexpr int kChunk = 3 * 256;  // entries; blocks of three stay whole

double sum(const std::vector<double>& partial) { return std::accumulate(partial.begin(), partial.end(), 0.0); }

double dot(const Eigen::VectorXd& a, const Eigen::VectorXd& b, std::vector<double>& partial, const ThreadPool& pool) {
  const auto body = [&](int begin, int end) {
    partial[begin / kChunk] = a.segment(begin, end - begin).dot(b.segment(begin, end - begin));
  };
  pool.for_chunks(static_cast<int>(a.size()), kChunk, std::cref(body));
  return sum(partial);
}

// x += alpha p, r -= alpha Ap; if P is block diagonal, z = P^-1 r too, and r . z is returned.
double advance(double alpha, const BlockMap& precondition_blocks, CgWorkspace& w, Eigen::VectorXd& x, const ThreadPool& pool) {
  const auto entries = [&](int begin, int end) {
    const int n = end - begin;
    x.segment(begin, n) += alpha * w.p.segment(begin, n);
    w.r.segment(begin, n) -= alpha * w.Ap.segment(begin, n);
    if (!precondition_blocks) return;
    precondition_blocks(begin / 3, end / 3, w.r, w.z);
    w.partial_sums[begin / kChunk] = w.r.segment(begin, n).dot(w.z.segment(begin, n));
  };
  pool.for_chunks(static_cast<int>(x.size()), kChunk, std::cref(entries));
  return precondition_blocks ? sum(w.partial_sums) : 0;
}

// p = z + beta p
void turn(double beta, CgWorkspace& w, const ThreadPool& pool) {
  const auto body = [&](int begin, int end) {
    auto p = w.p.segment(begin, end - begin);
    p = w.z.segment(begin, end - begin) + beta * p;
  };
  pool.for_chunks(static_cast<int>(w.p.size()), kChunk, std::cref(body));
}

}  // namespace

void CgWorkspace::resize(Eigen::Index size) {
  if (r.size() == size) return;
  for (Eigen::VectorXd* v : {&r, &z, &p, &Ap}) v->resize(size);
  partial_sums.assign((size + kChunk - 1) / kChunk, 0.0);
}

SolveReport conjugate_gradient(const LinearMap& apply, const LinearMap& precondition, const Eigen::VectorXd& b,
                               Eigen::VectorXd& x, const SolveOptions& options, CgWorkspace& w,
                               const ThreadPool& pool, const SquaredNorm& norm, const BlockMap& precondition_blocks,
                               const DotMap& apply_and_dot) {
  assert(x.size() == b.size());
  w.resize(b.size());
  double size = 0;
  if (norm) {
    size = norm(b);
  } else if (options.near_inverse) {
    size = dot(b, b, w.partial_sums, pool);  // whether there is any; followed below
  } else {
    precondition(b, w.z);
    size = dot(b, w.z, w.partial_sums, pool);
  }
  if (!std::isfinite(size)) return {0, std::numeric_limits<double>::quiet_NaN(), false};
  if (size <= 0) {
    x.setZero();
    return {0, 0, true};
  }

  if (!options.has_residual) {
    apply(x, w.Ap);
    w.r = b - w.Ap;
  }

  SolveReport report;
  double best = std::numeric_limits<double>::infinity();
  int best_at = 0;
  const auto ends = [&](double squared_norm) {
    if (options.near_inverse && !norm) size = std::abs(dot(b, x, w.partial_sums, pool));
    if (!(squared_norm >= 0) || !std::isfinite(squared_norm) || !std::isfinite(size)) {
      report.residual = std::numeric_limits<double>::quiet_NaN();
      report.converged = false;
      return true;
    }
    report.residual = squared_norm == 0 ? 0 : std::sqrt(squared_norm / size);  // infinite where x = 0 says nothing of b's size
    report.converged = report.residual <= options.tolerance;
    if (report.converged) return true;
    if (report.residual < best) {
      best = report.residual;
      best_at = report.iterations;
    }
    return report.iterations >= options.max_iterations || report.iterations - best_at >= kStagnationWindow ||
           report.residual > kDivergence * best;
  };
  double rz = 0, rz_next = 0;
  while (true) {
    if (norm && ends(norm(w.r))) return report;  // before the preconditioner, which may be dear, is asked once more
    const double rz_before = rz;
    if (!precondition_blocks || report.iterations == 0) {
      precondition(w.r, w.z);
      rz = dot(w.r, w.z, w.partial_sums, pool);
    } else {
      rz = rz_next;
    }
    if (!norm && ends(rz)) return report;
    if (report.iterations == 0) w.p = w.z;
    else turn(rz / rz_before, w, pool);

    if (!apply_and_dot) apply(w.p, w.Ap);
    const double alpha = rz / (apply_and_dot ? apply_and_dot(w.p, w.Ap) : dot(w.p, w.Ap, w.partial_sums, pool));
    if (!(alpha > 0) || !std::isfinite(alpha)) return report;
    rz_next = advance(alpha, precondition_blocks, w, x, pool);
    ++report.iterations;
  }
}

}  // namespace crumple::sim::linear_solver
