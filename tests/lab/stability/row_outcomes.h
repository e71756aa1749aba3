#pragma once

#include "server/lab/stability/row.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace crumple::lab::stability {

// The brief check of a row for a method of the table.
inline Outcome outcome_of(int row, const std::string& method) {
  const auto at = std::ranges::find(all_rows(), row, &Row::number);
  const Method* found = find_method(method);
  EXPECT_NE(at, all_rows().end()) << row;
  EXPECT_TRUE(found && found->family == at->family) << method;
  return at->check(*found, {.brief = true});
}

inline void expect_verdict(int row, const std::string& method, Verdict verdict) {
  const Outcome outcome = outcome_of(row, method);
  EXPECT_EQ(outcome.verdict, verdict) << "row " << row << ", " << method << ": " << name_of(outcome.verdict) << ", "
                                      << outcome.text;
}

}  // namespace crumple::lab::stability
