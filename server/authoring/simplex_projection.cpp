#include "server/authoring/simplex_projection.h"

namespace crumple::authoring {

void project_rows_to_simplex(sim::linear_solver::RowMatrix& rows) {
  // The projection is max(0, x - theta). Entries at or below the theta that those still in the sum ask for are zero in
  // the end; without them theta only grows, so each pass drops some until none is left to drop.
  for (int i = 0; i < rows.rows(); ++i) {
    double theta = (rows.row(i).sum() - 1) / static_cast<double>(rows.cols());
    for (Eigen::Index kept = rows.cols();;) {
      double sum = 0;
      Eigen::Index count = 0;
      for (const double x : rows.row(i))
        if (x > theta) {
          sum += x;
          ++count;
        }
      if (count >= kept || count == 0) break;  // ties may come back by rounding; none: not finite
      kept = count;
      theta = (sum - 1) / static_cast<double>(count);
    }
    rows.row(i) = (rows.row(i).array() - theta).max(0);
  }
}

}  // namespace crumple::authoring
