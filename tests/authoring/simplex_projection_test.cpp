#include "server/authoring/simplex_projection.h"

#include <gtest/gtest.h>

namespace crumple::authoring {
namespace {

using sim::linear_solver::RowMatrix;

TEST(SimplexProjection, IsTheNearestPointOfTheSimplex) {
  RowMatrix rows(4, 3);
  rows << 0.2, 0.3, 0.5, 2, 0, 0, 1, 1, -5, -1, -1, -1;
  project_rows_to_simplex(rows);
  RowMatrix expected(4, 3);
  expected << 0.2, 0.3, 0.5, 1, 0, 0, 0.5, 0.5, 0, 1.0 / 3, 1.0 / 3, 1.0 / 3;
  EXPECT_LT((rows - expected).cwiseAbs().maxCoeff(), 1e-15);

  // Nearest: for any point y of the simplex, (x - p) . (y - p) <= 0.
  const RowMatrix x = 2 * RowMatrix::Random(50, 7);
  RowMatrix p = x;
  project_rows_to_simplex(p);
  for (int i = 0; i < x.rows(); ++i)
    for (int corner = 0; corner < 7; ++corner) {
      Eigen::RowVectorXd y = Eigen::RowVectorXd::Zero(7);
      y[corner] = 1;
      EXPECT_LE((x.row(i) - p.row(i)).dot(y - p.row(i)), 1e-14);
    }
}

}  // namespace
}  // namespace crumple::authoring
