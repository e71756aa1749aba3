#include "server/sim/linear_solver/cholesky.h"

#ifdef CRUMPLE_HAVE_CHOLMOD
#include <cholmod.h>
#else
#include <Eigen/SparseCholesky>
#endif

#include <algorithm>
#include <cassert>
#include <span>
#include <utility>
#include <vector>

namespace crumple::sim::linear_solver {

namespace {

// Tells whether the pattern is the one seen before.
class Pattern {
 public:
  bool update(const Eigen::SparseMatrix<double>& A) {
    const std::span outer(A.outerIndexPtr(), static_cast<std::size_t>(A.outerSize() + 1));
    const std::span inner(A.innerIndexPtr(), static_cast<std::size_t>(A.nonZeros()));
    if (std::ranges::equal(outer, outer_) && std::ranges::equal(inner, inner_)) return false;
    outer_.assign(outer.begin(), outer.end());
    inner_.assign(inner.begin(), inner.end());
    return true;
  }

 private:
  std::vector<int> outer_, inner_;
};

bool all_finite(const Eigen::SparseMatrix<double>& A) {
  return Eigen::Map<const Eigen::VectorXd>(A.valuePtr(), A.nonZeros()).allFinite();
}

}  // namespace

#ifdef CRUMPLE_HAVE_CHOLMOD

struct Cholesky::Impl {
  cholmod_common common;
  cholmod_factor* L = nullptr;
  Pattern pattern;
  std::vector<int> analyzed_stage;

  explicit Impl(Ordering ordering) {
    cholmod_start(&common);
    if (ordering == Ordering::nested_dissection) {
      common.nmethods = 1;
      common.method[0].ordering = CHOLMOD_METIS;
    }
    common.print = 0;
    common.final_ll = 1;  // L L^T: a negative pivot is a failure, where L D L^T would go on
  }
  ~Impl() {
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }

  // By minimum degree within the stages. Null: not enough memory.
  cholmod_factor* analyze(cholmod_sparse& A, std::span<const int> stage) {
    std::vector<int> order(stage.size());
    if (!cholmod_camd(&A, nullptr, 0, const_cast<int*>(stage.data()), order.data(), &common)) return nullptr;
    const int methods = std::exchange(common.nmethods, 1), ordering = std::exchange(common.method[0].ordering, CHOLMOD_GIVEN);
    cholmod_factor* L = cholmod_analyze_p(&A, order.data(), nullptr, 0, &common);
    common.method[0].ordering = ordering;
    common.nmethods = methods;
    return L;
  }

  bool factor(const Eigen::SparseMatrix<double>& A, std::span<const int> stage) {
    cholmod_sparse view{};
    view.nrow = view.ncol = static_cast<std::size_t>(A.rows());
    view.nzmax = static_cast<std::size_t>(A.nonZeros());
    view.p = const_cast<int*>(A.outerIndexPtr());
    view.i = const_cast<int*>(A.innerIndexPtr());
    view.x = const_cast<double*>(A.valuePtr());
    view.stype = -1;  // lower triangle
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = view.packed = 1;
    if (pattern.update(A) || !L || !std::ranges::equal(stage, analyzed_stage)) {
      analyzed_stage.assign(stage.begin(), stage.end());
      cholmod_free_factor(&L, &common);
      if (!stage.empty()) L = analyze(view, stage);
      if (!L) L = cholmod_analyze(&view, &common);
      if (!L && common.nmethods == 1) {  // a build without METIS
        common.nmethods = 0;
        L = cholmod_analyze(&view, &common);
      }
      if (!L) return false;
    }
    cholmod_factorize(&view, L, &common);
    return common.status == CHOLMOD_OK && L->minor == L->n;
  }

  Eigen::VectorXd solve(const Eigen::VectorXd& b) {
    cholmod_dense view{};
    view.nrow = view.d = view.nzmax = static_cast<std::size_t>(b.size());
    view.ncol = 1;
    view.x = const_cast<double*>(b.data());
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    cholmod_dense* result = cholmod_solve(CHOLMOD_A, L, &view, &common);
    assert(result);
    Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(result->x), b.size());
    cholmod_free_dense(&result, &common);
    return x;
  }

  Factor copy_factor() {
    Factor out;
    const int* order = static_cast<const int*>(L->Perm);
    out.order.assign(order, order + L->n);
    cholmod_factor* copy = cholmod_copy_factor(L, &common);  // the conversion below takes it apart
    cholmod_sparse* sparse = cholmod_factor_to_sparse(copy, &common);
    assert(sparse);
    const int n = static_cast<int>(sparse->nrow), *outer = static_cast<const int*>(sparse->p);
    out.L = Eigen::Map<const Eigen::SparseMatrix<double>>(n, n, outer[n], outer, static_cast<const int*>(sparse->i),
                                                          static_cast<const double*>(sparse->x));
    cholmod_free_sparse(&sparse, &common);
    cholmod_free_factor(&copy, &common);
    return out;
  }
};

#else

struct Cholesky::Impl {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> ldlt;
  Pattern pattern;

  explicit Impl(Ordering) {}

  bool factor(const Eigen::SparseMatrix<double>& A, std::span<const int>) {
    if (pattern.update(A)) ldlt.analyzePattern(A);
    ldlt.factorize(A);
    return ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0;
  }

  Eigen::VectorXd solve(const Eigen::VectorXd& b) { return ldlt.solve(b); }

  Factor copy_factor() {
    Factor out;
    const Eigen::VectorXd scale = ldlt.vectorD().cwiseSqrt();
    Eigen::SparseMatrix<double> L = ldlt.matrixL();
    Eigen::SparseMatrix<double> unit(L.rows(), L.cols());
    unit.setIdentity();
    L = L.triangularView<Eigen::StrictlyLower>();
    out.L = (L + unit) * scale.asDiagonal();
    const auto& inverse = ldlt.permutationPinv().indices();
    out.order.assign(inverse.data(), inverse.data() + inverse.size());
    return out;
  }
};

#endif

Cholesky::Cholesky(Ordering ordering) : impl_(std::make_unique<Impl>(ordering)) {}
Cholesky::~Cholesky() = default;
Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;

bool Cholesky::factor(const Eigen::SparseMatrix<double>& A, std::span<const int> stage) {
  assert(A.rows() == A.cols() && A.isCompressed() && (stage.empty() || static_cast<Eigen::Index>(stage.size()) == A.rows()));
  return A.rows() > 0 && all_finite(A) && impl_->factor(A, stage);
}
bool Cholesky::factor(const Eigen::SparseMatrix<double>& A) { return factor(A, {}); }
bool Cholesky::factor(const BlockSparseMatrix<double>& A) { return factor(A.to_sparse()); }
bool Cholesky::factor(const BlockSparseMatrix<float>& A) { return factor(A.to_sparse()); }

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& b) const { return impl_->solve(b); }
Cholesky::Factor Cholesky::copy_factor() const { return impl_->copy_factor(); }

}  // namespace crumple::sim::linear_solver
