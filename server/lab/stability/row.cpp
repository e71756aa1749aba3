#include "server/lab/stability/row.h"

#include <algorithm>

namespace crumple::lab::stability {

const std::vector<Row>& all_rows() {
  static const std::vector<Row> rows = [] {
    std::vector<Row> all;
    for (auto group : {inversion_rows, rotation_rule_rows, element_rows, integration_rows, contact_rows, fracture_rows,
                       example_rows, rigid_rows, server_rows})
      for (Row& row : group()) all.push_back(std::move(row));
    std::ranges::sort(all, {}, &Row::number);
    return all;
  }();
  return rows;
}

}  // namespace crumple::lab::stability
